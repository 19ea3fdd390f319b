#!/usr/bin/env python3
"""Turns the measured spectra of the Cornell box into linear Rec. 709 colours, the numbers of src/scene/builtin/cornell.cpp.

Usage: tools/cornell_rgb.py CBOX.XML      a Mitsuba 0.4 file that holds the spectra "wavelength:value, ..."

Colour matching: the multi-lobe fit of the CIE 1931 2-degree observer, Wyman, Sloan and Shirley 2013, "Simple Analytic
Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), equation 4 and table 1.
The light's radiance is scaled so that a constant spectrum of 1 has the luminance Y = 1. An albedo is the colour of the
light reflected once, divided channel by channel by the colour of the light: so what is lit directly has the colour that
a spectral renderer gives it.
"""
import math
import re
import sys
import xml.etree.ElementTree as ElementTree

RGB_FROM_XYZ = ((3.2404542, -1.5371385, -0.4985314), (-0.9692660, 1.8760108, 0.0415560),
                (0.0556434, -0.2040259, 1.0572252))
LOBES = (((1.056, 599.8, 37.9, 31.0), (0.362, 442.0, 16.0, 26.7), (-0.065, 501.1, 20.4, 26.2)),
         ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1)),
         ((1.217, 437.0, 11.8, 36.0), (0.681, 459.0, 26.0, 13.8)))
WAVELENGTHS = range(400, 701)


def matching(axis, wavelength):
    total = 0.0
    for height, mean, left, right in LOBES[axis]:
        t = (wavelength - mean) / (left if wavelength < mean else right)
        total += height * math.exp(-0.5 * t * t)
    return total


def sample(spectrum, wavelength):
    """Piecewise linear, constant beyond the ends."""
    if wavelength <= spectrum[0][0]:
        return spectrum[0][1]
    for (x0, y0), (x1, y1) in zip(spectrum, spectrum[1:]):
        if wavelength <= x1:
            return y0 + (y1 - y0) * (wavelength - x0) / (x1 - x0)
    return spectrum[-1][1]


def rgb(function):
    norm = sum(matching(1, w) for w in WAVELENGTHS)
    xyz = [sum(matching(axis, w) * function(w) for w in WAVELENGTHS) / norm for axis in range(3)]
    return [sum(m * c for m, c in zip(row, xyz)) for row in RGB_FROM_XYZ]


def main():
    root = ElementTree.parse(sys.argv[1]).getroot()
    spectra = {}
    for owner in list(root.iter("bsdf")) + list(root.iter("emitter")):
        text = owner.find("spectrum").get("value")
        pairs = [tuple(map(float, p)) for p in re.findall(r"(\d+):([\d.]+)", text)]
        spectra[owner.get("id", "emission")] = pairs
    light = lambda w: sample(spectra["emission"], w)
    emission = rgb(light)
    print("emission", " ".join(f"{c:.4f}" for c in emission))
    for name, spectrum in spectra.items():
        if name == "emission":
            continue
        reflected = rgb(lambda w: light(w) * sample(spectrum, w))
        print(name, " ".join(f"{r / e:.4f}" for r, e in zip(reflected, emission)))


main()
