"""What came of drives, as rows: written, asked, and driven again."""
