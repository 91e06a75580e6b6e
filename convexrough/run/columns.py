"""Text in columns: it lives in `tabular`."""

from convexrough.tabular.columns import aligned as aligned
from convexrough.tabular.columns import markdown as markdown
