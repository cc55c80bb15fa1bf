// Colours: the map from a value to a colour, and the step between light and screen values.
#pragma once

#include <array>

namespace palpate {

// Red, green, blue. "Encoded": sRGB as a screen or a PNG takes it, 0 to 1. "Linear": proportional to light,
// which is what shading and anti-aliasing may add and scale.
using Colour = std::array<double, 3>;

// The encoded colour of t in [0, 1] (outside: the nearest end) on the map viridis: equal steps of the value
// look equally large, also in grey and to colour-blind eyes. Samples of the map by van der Walt and Smith
// (matplotlib, CC0).
Colour viridis(double t);

Colour to_linear(const Colour& encoded);
Colour to_encoded(const Colour& linear);  // values outside 0 to 1 are clamped first

}  // namespace palpate
