"""Shear along one direction (Ciavarella and Jaeger): states, cycles, histories."""
