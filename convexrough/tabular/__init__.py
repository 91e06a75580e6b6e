"""Files of numbers and names of units in common forms: text, arrays and workbooks."""
