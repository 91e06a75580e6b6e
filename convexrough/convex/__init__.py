"""Mathematics without contact mechanics: Newton steps on normal maps, cones, definiteness."""
