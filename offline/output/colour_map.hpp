// Maps values to colours, and linear light to screen values.
#pragma once

#include <array>

namespace palpate {

// Red, green, blue. "Encoded": sRGB of a screen or a PNG, 0 to 1. "Linear": proportional to light.
using Colour = std::array<double, 3>;

// Returns the encoded colour of t on the map viridis; clamps t to [0, 1]. Equal steps of t look equal, also
// in grey and to colour-blind eyes. Samples by van der Walt and Smith (matplotlib, CC0).
Colour viridis(double t);

// Returns viridis without its darkest quarter, which would hide the shading of a surface.
Colour shaded_colour(double share);

inline constexpr Colour kPage = {1, 1, 1};  // encoded: the background of a figure

Colour to_linear(const Colour& encoded);
Colour to_encoded(const Colour& linear);  // clamps values to 0 .. 1 first

}  // namespace palpate
