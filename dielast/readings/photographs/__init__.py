"""From photographs of an electrode to its outline, and from the outlines of a series to stretches with standard errors.

- camera: the grey values and the geometry of a photograph, and the tilt and lens that are corrected.
- find: where in a photograph the electrode is, roughly.
- rim: the edge of the electrode along its outline, at a fraction of a pixel.
- ellipse: the ellipse through the edge, and its standard errors.
- outline: these three together, for one photograph.
- series: the stretches of a series of photographs, and which photographs are doubtful.
- decode: the pictures of a file.
"""
