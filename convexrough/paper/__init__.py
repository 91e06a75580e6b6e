"""The example of the source paper (Dini and Hills 2009): its numbers and its figures."""
