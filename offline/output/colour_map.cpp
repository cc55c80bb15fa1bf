#include "offline/output/colour_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace palpate {
namespace {

// 33 equally spaced samples; linear interpolation stays within 0.007 of the original 256.
constexpr std::array<Colour, 33> kViridis = {{
    {0.2670, 0.0049, 0.3294}, {0.2770, 0.0502, 0.3755}, {0.2823, 0.0946, 0.4170}, {0.2829, 0.1354, 0.4530},
    {0.2789, 0.1749, 0.4830}, {0.2708, 0.2133, 0.5066}, {0.2593, 0.2507, 0.5244}, {0.2454, 0.2867, 0.5370},
    {0.2302, 0.3213, 0.5455}, {0.2148, 0.3545, 0.5510}, {0.2000, 0.3864, 0.5545}, {0.1861, 0.4173, 0.5567},
    {0.1733, 0.4474, 0.5579}, {0.1613, 0.4770, 0.5581}, {0.1497, 0.5064, 0.5573}, {0.1384, 0.5358, 0.5551},
    {0.1281, 0.5651, 0.5509}, {0.1209, 0.5945, 0.5442}, {0.1203, 0.6238, 0.5343}, {0.1310, 0.6529, 0.5208},
    {0.1554, 0.6815, 0.5032}, {0.1930, 0.7096, 0.4812}, {0.2415, 0.7366, 0.4545}, {0.2986, 0.7624, 0.4230},
    {0.3629, 0.7867, 0.3866}, {0.4330, 0.8091, 0.3453}, {0.5081, 0.8292, 0.2992}, {0.5873, 0.8470, 0.2489},
    {0.6694, 0.8622, 0.1954}, {0.7529, 0.8751, 0.1427}, {0.8359, 0.8861, 0.1025}, {0.9166, 0.8961, 0.1008},
    {0.9932, 0.9062, 0.1439},
}};

}  // namespace

Colour viridis(double t) {
  const double place = std::clamp(t, 0.0, 1.0) * static_cast<double>(kViridis.size() - 1);
  const std::size_t below = std::min(static_cast<std::size_t>(place), kViridis.size() - 2);
  const double share = place - static_cast<double>(below);
  Colour colour;
  for (std::size_t i = 0; i < 3; ++i)
    colour[i] = (1.0 - share) * kViridis[below][i] + share * kViridis[below + 1][i];
  return colour;
}

Colour shaded_colour(double share) {
  constexpr double kFirst = 0.25;
  return viridis(kFirst + (1.0 - kFirst) * share);
}

// This function and the next are the transfer function of sRGB, IEC 61966-2-1, and its inverse.
Colour to_linear(const Colour& encoded) {
  Colour linear;
  for (std::size_t i = 0; i < 3; ++i)
    linear[i] = encoded[i] <= 0.04045 ? encoded[i] / 12.92 : std::pow((encoded[i] + 0.055) / 1.055, 2.4);
  return linear;
}

Colour to_encoded(const Colour& linear) {
  Colour encoded;
  for (std::size_t i = 0; i < 3; ++i) {
    const double value = std::clamp(linear[i], 0.0, 1.0);
    encoded[i] = value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
  }
  return encoded;
}

}  // namespace palpate
