"""Speed against error: every solver, at many sizes, with the true error of each answer."""

from convexrough.bench.files import write_bench
from convexrough.bench.plan import Plan, full_plan, quick_plan
from convexrough.bench.suite import Bench, Panel, run
from convexrough.bench.summary import describe, split_page, summarise

__all__ = [
    "Bench",
    "Panel",
    "Plan",
    "describe",
    "full_plan",
    "quick_plan",
    "run",
    "split_page",
    "summarise",
    "write_bench",
]
