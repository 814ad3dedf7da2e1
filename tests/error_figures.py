"""FLIP and SSIM of two image files by their authors' and scikit-image's code.

Usage: error_figures.py IMAGE REFERENCE ERRORS.f32

Writes FLIP's error of each pixel and prints its mean and the SSIM. Exits with 77 where a package is absent.
"""

import sys

try:
    import flip_evaluator
    import numpy
    from skimage.metrics import structural_similarity
except ImportError:
    sys.exit(77)

image, reference, errors_path = sys.argv[1:]
kind = "HDR" if image.endswith(".exr") else "LDR"
image, reference = flip_evaluator.load(image), flip_evaluator.load(reference)
errors, _, _ = flip_evaluator.evaluate(reference, image, kind, applyMagma=False)
errors.astype("<f4").tofile(errors_path)
similarity = structural_similarity(
    image.astype(numpy.float64),
    reference.astype(numpy.float64),
    gaussian_weights=True,
    sigma=1.5,
    use_sample_covariance=False,
    data_range=1,
    channel_axis=2,
)
print(float(errors.mean(dtype=numpy.float64)).hex(), float(similarity).hex())
