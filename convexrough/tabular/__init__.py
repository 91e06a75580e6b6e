"""Tables and names of units as people have them: text, arrays and workbooks."""
