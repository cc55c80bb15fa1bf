// The monomials of two contacts' loads x and y, for the interaction terms of a pair. m_j are the quadratic
// monomials:
//   x_a y_b at 3 a + b | xx xy xz yy yz zz of x | the same of y |
//   m_j(x) y_b at 3 j + b | x_a m_j(y) at 6 a + j | xxx xxy ... zzz of x | the same of y
// The first line has degree 2, the second line degree 3. This order is part of the format.
#pragma once

#include <stdint.h>

#include <array>

#include "schemas/monomials.hpp"

namespace palpate::pack {

// The positions of the factors among the monomials of x and of y, counted from degree 0.
struct PairMonomial {
  uint32_t of_x;
  uint32_t of_y;
};

inline constexpr uint32_t kLeastPairDegree = 2;
inline constexpr uint32_t kMostPairDegree = 3;

constexpr uint32_t num_pair_monomials(uint32_t degree) {
  const uint32_t of_second = 9 + 2 * num_monomials(2);
  return degree < 3 ? of_second : of_second + 2 * 3 * num_monomials(2) + 2 * num_monomials(3);
}

// All pair monomials in order.
inline constexpr std::array<PairMonomial, num_pair_monomials(kMostPairDegree)> kPairMonomials = [] {
  std::array<PairMonomial, num_pair_monomials(kMostPairDegree)> all = {};
  uint32_t count = 0;
  const auto products = [&](uint32_t degree_of_x, uint32_t degree_of_y) {
    for (uint32_t i = 0; i < num_monomials(degree_of_x); ++i) {
      for (uint32_t j = 0; j < num_monomials(degree_of_y); ++j)
        all[count++] = {monomial_start(degree_of_x) + i, monomial_start(degree_of_y) + j};
    }
  };
  products(1, 1);
  products(2, 0);
  products(0, 2);
  products(2, 1);
  products(1, 2);
  products(3, 0);
  products(0, 3);
  return all;
}();

}  // namespace palpate::pack
