"""Mathematics that knows no contact: Newton steps on normal maps, cones, solver libraries."""
