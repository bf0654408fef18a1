"""python denoise.py IN.exr... OUT.exr: the mean of images, denoised by Open Image Denoise.

Needs numpy, OpenEXR and pyoidn (all PyPI).
"""
import pathlib
import subprocess
import sys
import tempfile

import numpy
import OpenEXR
import pyoidn

import hall


def read(path):
    channels = OpenEXR.File(path).channels()
    name = next(name for name in channels if name.split(".")[-1] in ("RGB", "RGBA", "R"))
    if name.endswith("R"):
        stem = name[:-1]
        return numpy.stack([channels[stem + c].pixels for c in "RGB"], axis=-1).astype(numpy.float32)
    return channels[name].pixels[..., :3].astype(numpy.float32)


*images, out = sys.argv[1:]
mean = numpy.mean([read(image) for image in images], axis=0)
program = pathlib.Path(pyoidn.__file__).parent / "oidn" / "bin" / "oidnDenoise"
with tempfile.TemporaryDirectory() as folder:
    noisy, clean = pathlib.Path(folder) / "noisy.pfm", pathlib.Path(folder) / "clean.pfm"
    hall.write_pfm(noisy, mean)
    subprocess.run([program, "--hdr", noisy, "-o", clean], check=True, stdout=subprocess.DEVNULL)
    data = clean.read_bytes()
    width, height = hall.RESOLUTION
    pixels = numpy.frombuffer(data[-12 * width * height:], dtype="<f4").reshape(height, width, 3)[::-1]
header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
OpenEXR.File(header, {"RGB": numpy.ascontiguousarray(pixels)}).write(out)
