"""Tables of numbers read from text, workbooks and files of arrays; names of units."""
