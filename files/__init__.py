"""Read and write files: tables, JSON, tensors and arrays with a digest; whole files or none, one owner a folder."""
