"""The pages that a browser opens offline: report.html and play.html."""
