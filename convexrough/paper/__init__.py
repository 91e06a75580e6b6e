"""The example of the source paper (Dini and Hills 2009): numbers and figures."""
