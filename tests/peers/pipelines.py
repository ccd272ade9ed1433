"""Ten features of a picture as one would write them in Python. Pictures are rows × columns × bytes per pixel. The first
function of each kind is the published method: each taxel is cut out, resized to the paper's 50 × 50, and averaged.
"""

import cv2
import numpy as np

PAPER_TAXEL = (50, 50)
# Coefficients of green from Y, Cb, Cr: BT.601, limited range.
KR, KB = 0.299, 0.114
KG = 1 - KR - KB
LUMA, CB, CR = 255 / 219, 255 / 224 * 2 * KB * (1 - KB) / KG, 255 / 224 * 2 * KR * (1 - KR) / KG


def features(taxels):
    """Returns the features of the 25 mean greens, row by row."""
    taxels = np.reshape(taxels, (5, 5)) / 255
    return np.log(np.concatenate([taxels.sum(axis=1), taxels.sum(axis=0)]))


def resized(green, corners, side):
    """OpenCV: crop, resize, mean."""
    crops = (green[y : y + side, x : x + side] for x, y in corners)
    return features([cv2.mean(cv2.resize(crop, PAPER_TAXEL))[0] for crop in crops])


def cropped(green, corners, side):
    """OpenCV: crop, mean."""
    return features([cv2.mean(green[y : y + side, x : x + side])[0] for x, y in corners])


def gray_numpy(picture, corners, side):
    """NumPy: crop, mean."""
    return features([picture[y : y + side, x : x + side, 0].mean() for x, y in corners])


def green_of(yuyv):
    """Converts a whole picture to green with OpenCV."""
    return cv2.cvtColor(yuyv, cv2.COLOR_YUV2BGR_YUYV)[:, :, 1]


def converted_crops(picture, corners, side):
    """Returns the green of each taxel, and converts only the pairs of pixels that it touches."""
    for x, y in corners:
        first, end = x & ~1, (x + side + 1) & ~1
        yield green_of(np.ascontiguousarray(picture[y : y + side, first:end]))[:, x - first : x - first + side]


def crops_resized(picture, corners, side):
    """OpenCV: crop, convert, resize, mean."""
    return features([cv2.mean(cv2.resize(crop, PAPER_TAXEL))[0] for crop in converted_crops(picture, corners, side)])


def crops_converted(picture, corners, side):
    """OpenCV: crop, convert, mean."""
    return features([cv2.mean(crop)[0] for crop in converted_crops(picture, corners, side)])


def yuyv_numpy(picture, corners, side, real=np.float32):
    """NumPy: the green of each taxel's pixels, rounded and clamped, and its mean."""
    means = []
    for x, y in corners:
        first, end = x & ~1, (x + side + 1) & ~1
        cells = picture[y : y + side, first:end].reshape(side, -1, 4).astype(real)
        chroma = CB * (cells[:, :, 1] - 128) + CR * (cells[:, :, 3] - 128)
        green = LUMA * (cells[:, :, 0::2] - 16) - chroma[:, :, None]
        green = np.clip(np.floor(green + real(0.5)), 0, 255).reshape(side, -1)
        means.append(green[:, x - first : x - first + side].mean(dtype=np.float64))
    return features(means)


def reference(name, picture, corners, side):
    """Computes in 64 bits, without any library's shortcuts."""
    if name == "GREY":
        return features([picture[y : y + side, x : x + side, 0].astype(np.float64).mean() for x, y in corners])
    return yuyv_numpy(picture, corners, side, np.float64)


GREY = {
    "OpenCV: crop, resize, mean": lambda picture, corners, side: resized(picture[:, :, 0], corners, side),
    "OpenCV: crop, mean": lambda picture, corners, side: cropped(picture[:, :, 0], corners, side),
    "NumPy": gray_numpy,
}
YUYV = {
    "OpenCV: convert, crop, resize, mean": lambda picture, corners, side: resized(green_of(picture), corners, side),
    "OpenCV: convert, crop, mean": lambda picture, corners, side: cropped(green_of(picture), corners, side),
    "OpenCV: crop, convert, resize, mean": crops_resized,
    "OpenCV: crop, convert, mean": crops_converted,
    "NumPy": yuyv_numpy,
}
