#include "kernels/colour_difference.h"

#include <gtest/gtest.h>

#include "light_samples.h"

namespace lightcuts {
namespace {

// Vector of the reference's section 6.4; lightness agrees there, so leaving it out changes nothing.
TEST(ColourDifference, ReproducesThePublishedCie94Vector) {
  const double a1 = 21.57210357, b1 = 272.22819350, a2 = 426.67945353, b2 = 72.39590835;
  const double c1 = std::sqrt(a1 * a1 + b1 * b1), c2 = std::sqrt(a2 * a2 + b2 * b2);
  EXPECT_NEAR(cie94_without_lightness(a1, b1, c1, a2, b2, c2, c1), 83.7792255, 1e-6);
}

TEST(ColourDifference, FindsLabOfTheGamutsCorners) {
  struct Corner {
    Vec3T<double> rgb;
    double l, a, b, chroma;
  };
  const Corner corners[] = {
      {{1, 0, 0}, 53.241, 80.092, 67.203, 104.552},
      {{0, 1, 0}, 87.735, -86.183, 83.179, 119.776},
      {{0, 0, 1}, 32.297, 79.188, -107.860, 133.808},
      {{0, 1, 1}, 91.113, -48.088, -14.131, 50.121},
      {{1, 0, 1}, 60.324, 98.234, -60.825, 115.541},
      {{1, 1, 0}, 97.139, -21.554, 94.478, 96.905},
      {{1, 1, 1}, 100, 0, 0, 0},
  };
  for (const Corner& corner : corners) {
    const Vec3T<double> lab = lab_from_linear_rgb(corner.rgb);
    EXPECT_NEAR(lab.x, corner.l, 1e-3);
    EXPECT_NEAR(lab.y, corner.a, 2e-3);
    EXPECT_NEAR(lab.z, corner.b, 2e-3);
    const Chromaticity c = chromaticity(
        {static_cast<float>(corner.rgb.x), static_cast<float>(corner.rgb.y), static_cast<float>(corner.rgb.z)});
    EXPECT_NEAR(c.chroma, corner.chroma, 5e-3);
  }
}

TEST(ColourDifference, IsSymmetricZeroForEqualAndAtMostOne) {
  test::LightSamples samples(31);
  for (int i = 0; i < 100000; ++i) {
    const Chromaticity p = chromaticity(samples.point()), q = chromaticity(samples.point());
    const float difference = colour_difference(p, q);
    ASSERT_EQ(difference, colour_difference(q, p));
    ASSERT_EQ(colour_difference(p, p), 0.0f);
    ASSERT_GE(difference, 0.0f);
    ASSERT_LE(difference, 1.0f);
  }
  EXPECT_NEAR(colour_difference(chromaticity({0, 0, 1}), chromaticity({0, 1, 0})), 86.963f / 87, 1e-4f);
}

TEST(ColourDifference, DoesNotSeeIntensity) {
  const Chromaticity gray = chromaticity({0.5f, 0.5f, 0.5f});
  const float expected = colour_difference(chromaticity({0.8f, 0.2f, 0.1f}), gray);
  for (const float k : {1e-6f, 0.01f, 10.0f, 1e6f})
    EXPECT_NEAR(colour_difference(chromaticity(Vec3{0.8f, 0.2f, 0.1f} * k), gray), expected, 1e-5f);
  EXPECT_NEAR(colour_difference(chromaticity({0, 0, 0}), gray), 0.0f, 1e-4f);
}

}  // namespace
}  // namespace lightcuts
