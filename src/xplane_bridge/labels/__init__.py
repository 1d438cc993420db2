"""Labels of pictures: what lies where in each, projected from the camera's measured pose, with how sure that is.

Pixels are those of ``CameraInfo.K``: whole numbers are centres of pixels, (0, 0) that of the upper left one.
"""
