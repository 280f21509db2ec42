"""From measurements to a material: master curves and relaxation spectra."""
