"""Prints the means that flip_test.cpp expects, by the published evaluator.

    python3 -m venv /tmp/flip && /tmp/flip/bin/pip install flip-evaluator==1.7 numpy
    /tmp/flip/bin/python tests/image/flip_expected.py
"""
import flip_evaluator
import numpy

# The same integer formulas stand in flip_test.cpp: sRGB bytes of channel c at (x, y).
PATTERNS = {
    "ramp": lambda x, y, c: (3 * x + 2 * y + 40 * c) % 256,
    "brighter ramp": lambda x, y, c: min(255, (3 * x + 2 * y + 40 * c) % 256 + 12),
    "checker": lambda x, y, c: 230 if (x // 8 + y // 8) % 2 else 25,
    "shifted checker": lambda x, y, c: 230 if ((x + 1) // 8 + y // 8) % 2 else 25,
    "noise": lambda x, y, c: (x * 7919 + y * 104729 + c * 1299709 + x * y * 31) % 251,
    "lines": lambda x, y, c: 255 if (x + 2 * y) % 11 == c else 60,
    "green": lambda x, y, c: 255 if c == 1 else 0,
    "blue": lambda x, y, c: 255 if c == 2 else 0,
    "stains": lambda x, y, c: 255 if (x - 30) ** 2 + (y - 20) ** 2 < 150 * (c + 1) else 128,
}
PAIRS = [("ramp", "brighter ramp", 96, 64, 67), ("checker", "shifted checker", 96, 64, 67),
         ("noise", "ramp", 96, 64, 67), ("lines", "noise", 61, 83, 67), ("green", "blue", 40, 30, 67),
         ("stains", "lines", 96, 64, 67), ("ramp", "ramp", 16, 16, 67), ("stains", "checker", 96, 64, 30),
         ("noise", "shifted checker", 5, 3, 67)]


def picture(name, width, height):
    f = PATTERNS[name]
    return numpy.array([[[f(x, y, c) / 255 for c in range(3)] for x in range(width)] for y in range(height)],
                       dtype=numpy.float32)


for test, reference, width, height, ppd in PAIRS:
    errors, mean, _ = flip_evaluator.evaluate(picture(reference, width, height), picture(test, width, height), "LDR",
                                              inputsRGB=True, applyMagma=False, parameters={"ppd": float(ppd)})
    errors = numpy.asarray(errors)
    x, y = width // 3, height // 2
    print(f'{{"{test}", "{reference}", {width}, {height}, {ppd}, {errors.mean(dtype=numpy.float64):.7f}, '
          f'{errors[y, x].item():.6f}}},')
