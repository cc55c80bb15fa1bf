// Opening refuses packs whose polynomial tables contradict one another.
#include <gtest/gtest.h>

#include "tests/support/mutated_pack_fixture.hpp"

namespace palpate::test::mutated_pack_fixture {
namespace contradicting_polynomials_test {

const pack::PolynomialDd& polynomials_of(const AlignedBytes& bytes) {
  return *pack::GetPack(bytes.bytes().data() + sizeof(pack::PackHeader))->polynomial_dd();
}

// Status after `change` to the record of site 2.
template <typename Change>
pal_status status_with_site(Change&& change, const AlignedBytes& original = small_pack_bytes()) {
  return status_with<pack::PolynomialSite>(
      polynomials_of(original).sites(), [&](pack::PolynomialSite* sites) { change(sites[2]); }, original);
}

TEST_F(Contradiction, PolynomialSites) {
  using Site = pack::PolynomialSite;
  for (const AlignedBytes* bytes : {&small_pack_bytes(), &rounded_pack_bytes()}) {
    const bool rounded = bytes == &rounded_pack_bytes();
    SCOPED_TRACE(rounded ? "rounded" : "plain");
    const uint32_t degree = polynomials_of(*bytes).degree();
    const auto changed = [&](auto&& change) { return status_with_site(change, *bytes); };
    EXPECT_EQ(changed([](Site&) {}), PAL_STATUS_OK);
    for (const float wrong : {std::nanf(""), HUGE_VALF, -1e-3f, 3e38f}) {
      EXPECT_EQ(changed([&](Site& site) { site.linear_unit = wrong; }),
                rounded ? PAL_STATUS_CORRUPT_CONTENT : PAL_STATUS_OK)
          << wrong;
    }
    EXPECT_EQ(changed([](Site& site) { site.samples = 0; }), PAL_STATUS_OK) << "no frame reads it";
    for (const uint32_t wrong : {0u, degree + 1, 8u, 0xffffffffu})
      EXPECT_EQ(changed([&](Site& site) { site.degree = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
    // Other ranks and degrees need arrays of other lengths.
    EXPECT_EQ(changed([](Site& site) { --site.degree; }), PAL_STATUS_CORRUPT_CONTENT);
    for (const uint32_t wrong : {pack::kMostRank + 1, pack::kMostRank + 2, 0x80000000u, 0xffffffffu})
      EXPECT_EQ(changed([&](Site& site) { site.rank = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
    EXPECT_EQ(changed([](Site& site) { site.rank += 2; }), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(changed([](Site& site) { --site.rank; }), PAL_STATUS_CORRUPT_CONTENT);
    // Each site's part begins at the end of the part before: no gap, no overlap, no other order.
    for (uint64_t Site::*start : {&Site::energy_start, &Site::coefficients_start, &Site::field_start}) {
      for (const uint64_t by : {uint64_t{1}, uint64_t{64}, ~uint64_t{0}, uint64_t{1} << 63})
        EXPECT_EQ(changed([&](Site& site) { site.*start += by; }), PAL_STATUS_CORRUPT_CONTENT) << by;
      EXPECT_EQ(changed([&](Site& site) { site.*start = 0; }), PAL_STATUS_CORRUPT_CONTENT);
      EXPECT_EQ(status_with<Site>(
                    polynomials_of(*bytes).sites(), [&](Site* sites) { sites[0].*start = 64; }, *bytes),
                PAL_STATUS_CORRUPT_CONTENT);
    }
    for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e16, -1e16, 1e300})
      EXPECT_EQ(changed([&](Site& site) { site.to_unit[5] = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
    for (const double scale : {0.0, 1e-20, 1e-300}) {
      EXPECT_EQ(changed([&](Site& site) {
                  for (double& entry : site.to_unit) entry *= scale;
                }),
                PAL_STATUS_CORRUPT_CONTENT)
          << scale;
    }
    // Domains beyond the scene's largest displacement, and domains without an end in some direction.
    for (const double scale : {0.9, 4.5}) {
      EXPECT_EQ(changed([&](Site& site) {
                  for (double& entry : site.to_unit) entry *= scale;
                }),
                PAL_STATUS_CORRUPT_CONTENT)
          << scale;
    }
    EXPECT_EQ(changed([](Site& site) { std::copy(site.to_unit, site.to_unit + 3, site.to_unit + 3); }),
              PAL_STATUS_CORRUPT_CONTENT);
    for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL})
      EXPECT_EQ(changed([&](Site& site) { site.min_jacobian = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
    for (const double wrong : {std::nan(""), HUGE_VAL, -1e-3})
      EXPECT_EQ(changed([&](Site& site) { site.basis_error = wrong; }), PAL_STATUS_CORRUPT_CONTENT) << wrong;
  }
}

TEST_F(Contradiction, PolynomialNumbers) {
  const pal_real not_a_number = std::numeric_limits<pal_real>::quiet_NaN();
  for (const AlignedBytes* bytes : {&small_pack_bytes(), &rounded_pack_bytes()}) {
    const bool rounded = bytes == &rounded_pack_bytes();
    SCOPED_TRACE(rounded ? "rounded" : "plain");
    // Columns of int16 may hold any integer.
    const pal_status of_columns = rounded ? PAL_STATUS_OK : PAL_STATUS_CORRUPT_CONTENT;
    const pack::PolynomialDd& polynomial = polynomials_of(*bytes);
    const auto with_energy = [&](double value) {
      return status_with<double>(
          polynomial.energy(), [&](double* e) { e[40] = value; }, *bytes);
    };
    EXPECT_EQ(with_energy(1e300), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(with_energy(std::nan("")), PAL_STATUS_CORRUPT_CONTENT);
    const auto with = [&](const pack::Segment* segment, size_t place, pal_real value) {
      return status_with<pal_real>(
          segment, [&](pal_real* u) { u[place] = value; }, *bytes);
    };
    for (const pal_real wrong : {not_a_number, pal_real(3e38), pal_real(-1e20)}) {
      EXPECT_EQ(with(polynomial.coefficients(), 7, wrong), PAL_STATUS_CORRUPT_CONTENT) << wrong;
      // Columns of L, in the first panel and in the last panel.
      EXPECT_EQ(with(polynomial.field(), 40, wrong), of_columns) << wrong;
      const auto& last = reinterpret_cast<const pack::PolynomialSite*>(bytes->bytes().data() +
                                                                       polynomial.sites()->offset())[11];
      const uint64_t in_panel = pack::field_panel_bytes(3 + last.rank, rounded) / sizeof(pal_real);
      const uint64_t of_linear = rounded ? pack::rounded_panel_numbers(3) * sizeof(int16_t) / sizeof(pal_real)
                                         : 3 * pack::kPanelRows;
      const uint64_t in_last = polynomial.field()->bytes() / sizeof(pal_real) - in_panel + of_linear - 1;
      EXPECT_EQ(with(polynomial.field(), in_last, wrong), of_columns) << wrong;
    }
    // Entries of the unrounded basis are within [-1, 1].
    for (const pal_real wrong : {not_a_number, pal_real(3e38), pal_real(-1.01)}) {
      EXPECT_EQ(with(polynomial.field(), 3 * pack::kPanelRows + 5, wrong), of_columns) << wrong;
    }
  }
}

TEST_F(Contradiction, PolynomialTable) {
  const AlignedBytes& rounded = rounded_pack_bytes();
  const uint32_t degree = polynomials_of(rounded).degree();
  const auto with_degree = [&](uint32_t value) {
    return status_with_scalar(pack::Pack::VT_POLYNOMIAL_DD, pack::PolynomialDd::VT_DEGREE, value, rounded);
  };
  EXPECT_EQ(with_degree(degree), PAL_STATUS_OK);
  for (const uint32_t wrong : {0u, degree - 1, pack::kMaxDegree + 1, 0xffffffffu})
    EXPECT_EQ(with_degree(wrong), PAL_STATUS_CORRUPT_CONTENT) << wrong;
  const auto with_precision = [&](uint8_t value) {
    return status_with_scalar(pack::Pack::VT_POLYNOMIAL_DD, pack::PolynomialDd::VT_PRECISION, value, rounded);
  };
  EXPECT_EQ(with_precision(1), PAL_STATUS_OK);
  for (const uint8_t wrong : {uint8_t{0}, uint8_t{2}, uint8_t{255}})
    EXPECT_EQ(with_precision(wrong), PAL_STATUS_CORRUPT_CONTENT) << int{wrong};
}

// Whole packs with consistent arrays, for degrees and ranks beyond a frame's capacity.
TEST_F(Contradiction, PolynomialsBeyondWhatAFrameHolds) {
  const auto written = [&](int degree, uint32_t rank, bool rounded) {
    std::vector<SiteResult> results = small_.polynomials;
    SitePolynomial& last = results.back().polynomial;
    const auto terms = [](int first, int end) {
      return static_cast<Eigen::Index>(
          pack::num_monomials(static_cast<uint32_t>(first), static_cast<uint32_t>(end)));
    };
    last.degree = degree;
    last.energy = Eigen::VectorXd::Ones(terms(2, degree + 1));
    last.basis = Eigen::MatrixXd::Zero(last.linear.rows(), rank);
    last.coefficients = Eigen::MatrixXd::Ones(terms(2, degree), rank) * 1e-3;
    PackContent content = small_.content();
    content.polynomials = &results;
    content.rounded = rounded;
    return write_pack(content);
  };
  for (const bool rounded : {false, true}) {
    const auto status_of = [&](int degree, uint32_t rank) {
      return open_status(written(degree, rank, rounded).bytes());
    };
    EXPECT_EQ(status_of(1, 0), PAL_STATUS_OK);
    constexpr int kDegree = pack::kMaxDegree;
    constexpr uint32_t kRank = pack::kMostRank;
    EXPECT_EQ(status_of(kDegree, kRank), PAL_STATUS_OK);
    EXPECT_EQ(status_of(kDegree, kRank + 1), PAL_STATUS_CORRUPT_CONTENT);
    EXPECT_EQ(status_of(kDegree + 1, kRank), PAL_STATUS_CORRUPT_CONTENT);
  }
  // Removes columns of the last site and shortens the arrays to match. int16 columns come in pairs.
  const auto status_of_rank = [&](uint32_t fewer, uint32_t fewer_packed) {
    AlignedBytes copy = written(3, 8, true);
    unsigned char* tables = copy.bytes().data() + header_of(copy.bytes()).tables_offset;
    auto* polynomial =
        flatbuffers::GetMutableRoot<flatbuffers::Table>(tables)->GetPointer<flatbuffers::Table*>(
            pack::Pack::VT_POLYNOMIAL_DD);
    const auto shorten = [&](flatbuffers::voffset_t field, uint64_t bytes) {
      auto* segment = reinterpret_cast<pack::Segment*>(polynomial->GetAddressOf(field));
      *segment = pack::Segment(segment->offset(), segment->bytes() - bytes);
    };
    const uint64_t panels = pack::num_panels(static_cast<uint32_t>(small_.sites.packed_nodes.size()));
    shorten(pack::PolynomialDd::VT_COEFFICIENTS, fewer * pack::num_monomials(2, 3) * sizeof(pal_real));
    shorten(pack::PolynomialDd::VT_FIELD, panels * (pack::field_panel_bytes(3 + 8, true) -
                                                    pack::field_panel_bytes(3 + 8 - fewer_packed, true)));
    auto* sites =
        reinterpret_cast<pack::PolynomialSite*>(copy.bytes().data() + polynomials_of(copy).sites()->offset());
    sites[small_.sites.sites.size() - 1].rank -= fewer;
    repair_checksum(copy.bytes());
    return open_status(copy.bytes());
  };
  for (uint32_t fewer = 0; fewer <= 3; ++fewer)
    EXPECT_EQ(status_of_rank(fewer, fewer), PAL_STATUS_OK) << fewer;
  EXPECT_EQ(status_of_rank(2, 0), PAL_STATUS_CORRUPT_CONTENT);
  EXPECT_EQ(status_of_rank(1, 3), PAL_STATUS_CORRUPT_CONTENT);
}

// Without verification a damaged pack may give wrong numbers, but the frame stays within its memory.
TEST_F(Contradiction, PolynomialsNobodyVerified) {
  AlignedBytes copy = copy_of(rounded_pack_bytes().bytes());
  const pack::PolynomialDd& table = polynomials_of(copy);
  auto* coefficients = reinterpret_cast<pal_real*>(copy.bytes().data() + table.coefficients()->offset());
  const uint64_t count = table.coefficients()->bytes() / sizeof(pal_real);
  for (const double wrong : {std::nan(""), HUGE_VAL, -HUGE_VAL, 3e38}) {
    std::fill(coefficients, coefficients + count, static_cast<pal_real>(wrong));
    const OpenPack pack(copy, PAL_VERIFY_NEVER);
    OwnedSession session(pack.get(), PAL_MODEL_POLYNOMIAL, 1, 0);
    session.touch({{0, {0.01, 0.01, -0.02}, 0, {}, {}, {}}});
    session.field();
  }
}

}  // namespace contradicting_polynomials_test
}  // namespace palpate::test::mutated_pack_fixture
