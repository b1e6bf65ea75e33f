"""What the reproductions of all chapters share: experiments and their results, claims, verdicts, tables, figures."""
