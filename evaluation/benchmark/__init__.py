"""Judge policies on the frozen tasks of `springfoot.tasks`: submissions, and the leaderboard made from them."""
