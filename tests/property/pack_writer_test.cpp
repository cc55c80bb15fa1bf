// The runtime reads what the builder writes: same content, same bytes, and every array in its place.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "schemas/monomials.hpp"
#include "schemas/pack_generated.h"
#include "tests/support/changed_pack.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace pack_writer_test {

const pack::Pack& tables_of(const AlignedBytes& bytes) {
  return *pack::GetPack(bytes.bytes().data() + sizeof(pack::PackHeader));
}

TEST(PackWriter, SameContentSameBytes) {
  const AlignedBytes again = small_pack().write();
  ASSERT_EQ(again.bytes().size(), small_pack_bytes().bytes().size());
  EXPECT_EQ(std::memcmp(again.bytes().data(), small_pack_bytes().bytes().data(), again.bytes().size()), 0);
}

TEST(PackWriter, OtherContentOtherChecksum) {
  PackContent content = small_pack().content();
  content.inputs[0].hash[31] = '1';
  EXPECT_NE(header_of(write_pack(content).bytes()).checksum, header_of(small_pack_bytes().bytes()).checksum);
}

TEST(PackWriter, SegmentsAreAlignedAdjoiningAndPaddedWithZeros) {
  const AlignedBytes& file = small_pack_bytes();
  const pack::Pack& tables = tables_of(file);
  const pack::PackHeader header = header_of(file.bytes());
  EXPECT_EQ(header.file_bytes, file.bytes().size());
  uint64_t next = pack::round_up(header.tables_offset + header.tables_bytes, pack::kAlignment);
  uint64_t used = header.tables_offset + header.tables_bytes;
  for (const pack::Segment* segment : {tables.geometry()->labels(),
                                       tables.geometry()->positions(),
                                       tables.geometry()->triangles(),
                                       tables.sites()->contact_nodes(),
                                       tables.sites()->site_nodes(),
                                       tables.sites()->patch_starts(),
                                       tables.sites()->patch_nodes(),
                                       tables.linear_dd()->contact_compliance(),
                                       tables.linear_dd()->field_compliance(),
                                       tables.linear_dd()->site_forces(),
                                       tables.polynomial_dd()->sites(),
                                       tables.polynomial_dd()->energy(),
                                       tables.polynomial_dd()->coefficients(),
                                       tables.polynomial_dd()->field(),
                                       tables.surface_bvh()->primitives(),
                                       tables.surface_bvh()->nodes(),
                                       tables.surface_bvh()->primitive_normals(),
                                       tables.surface_bvh()->site_normals(),
                                       tables.inputs()->Get(0)->contents(),
                                       tables.inputs()->Get(1)->contents()}) {
    EXPECT_EQ(segment->offset(), next);
    EXPECT_EQ(segment->offset() % pack::kAlignment, 0U);
    for (uint64_t byte = used; byte < segment->offset(); ++byte) ASSERT_EQ(file.bytes()[byte], 0);
    used = segment->offset() + segment->bytes();
    next = pack::round_up(used, pack::kAlignment);
  }
  EXPECT_EQ(next, file.bytes().size());
  for (uint64_t byte = used; byte < next; ++byte) ASSERT_EQ(file.bytes()[byte], 0);
}

TEST(PackWriter, RuntimeReadsWhatWasWritten) {
  const SmallPack& small = small_pack();
  const OpenPack pack(small_pack_bytes());
  const pal_pack_info info = pack.info();
  EXPECT_EQ(info.num_nodes, small.sites.packed_nodes.size());
  EXPECT_EQ(info.num_triangles, small.sites.triangles.size());
  EXPECT_EQ(info.num_sites, 12U);
  EXPECT_EQ(info.num_contact_nodes, small.sites.contact_nodes.size());
  EXPECT_EQ(info.max_contacts, 3U);
  EXPECT_EQ(info.has_linear, 1U);
  EXPECT_EQ(info.has_polynomial, 1U);
  EXPECT_EQ(info.polynomial_degree, static_cast<uint32_t>(highest_degree(small.polynomials)));
  EXPECT_EQ(info.max_displacement, kMaxDisplacement);
  EXPECT_EQ(info.tip_radius, kTipRadius);
  EXPECT_EQ(info.mean_surface_edge, small.sites.mean_surface_edge);
  const pal_geometry geometry = pack.face().geometry();
  for (uint32_t i = 0; i < geometry.num_nodes; ++i) {
    const auto node = static_cast<size_t>(small.sites.packed_nodes[i]);
    EXPECT_EQ(geometry.labels[i], small.model.labels[node]);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ(geometry.positions[3 * i + static_cast<uint32_t>(axis)], small.model.positions[node][axis]);
  }
  for (uint32_t t = 0; t < geometry.num_triangles; ++t) {
    for (size_t corner = 0; corner < 3; ++corner) {
      EXPECT_EQ(geometry.triangles[3 * t + corner], static_cast<uint32_t>(small.sites.triangles[t][corner]));
    }
  }
  for (uint32_t site = 0; site < info.num_sites; ++site) {
    uint32_t node = 0;
    ASSERT_EQ(pal_pack_get_site_node(pack.get(), site, &node), PAL_STATUS_OK);
    EXPECT_EQ(node, static_cast<uint32_t>(small.sites.sites[site].packed_node));
    uint32_t found = 0;
    ASSERT_EQ(pal_pack_find_site(pack.get(), geometry.labels[node], &found), PAL_STATUS_OK);
    EXPECT_EQ(found, site);
  }
  for (uint32_t i = 0; i < info.num_contact_nodes; ++i) {
    uint32_t found = 0;
    const auto packed = static_cast<size_t>(small.sites.contact_nodes[i]);
    ASSERT_EQ(pal_pack_find_contact_node(pack.get(), geometry.labels[packed], &found), PAL_STATUS_OK);
    EXPECT_EQ(found, i);
  }
}

TEST(PackWriter, AModelThatIsNotWantedIsNotCarried) {
  const AlignedBytes linear = small_pack().write_linear_only();
  EXPECT_EQ(tables_of(linear).polynomial_dd(), nullptr);
  EXPECT_NE(tables_of(linear).linear_dd(), nullptr);
  EXPECT_EQ(OpenPack(linear).info().has_polynomial, 0U);
  const AlignedBytes polynomial = small_pack().write_polynomial_only();
  EXPECT_EQ(tables_of(polynomial).linear_dd(), nullptr);
  EXPECT_EQ(OpenPack(polynomial).info().has_linear, 0U);
  EXPECT_LT(linear.bytes().size(), small_pack_bytes().bytes().size());
}

// The sites' records and file names, beside their arrays.
void expect_sites(const AlignedBytes& bytes, const std::vector<SiteResult>& results, bool rounded) {
  const pack::PolynomialDd& table = *tables_of(bytes).polynomial_dd();
  EXPECT_EQ(table.degree(), static_cast<uint32_t>(highest_degree(results)));
  EXPECT_EQ(table.precision(), rounded ? pack::FieldPrecision::i16 : pack::FieldPrecision::real);
  ASSERT_EQ(table.sites()->bytes(), results.size() * sizeof(pack::PolynomialSite));
  const auto* sites =
      reinterpret_cast<const pack::PolynomialSite*>(bytes.bytes().data() + table.sites()->offset());
  const size_t panels = pack::num_panels(tables_of(bytes).geometry()->num_nodes());
  uint64_t energy = 0;
  uint64_t coefficients = 0;
  uint64_t field = 0;
  for (size_t i = 0; i < results.size(); ++i) {
    const SitePolynomial& polynomial = results[i].polynomial;
    const pack::PolynomialSite& site = sites[i];
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        EXPECT_EQ(site.to_unit[3 * row + column], polynomial.to_unit(row, column));
    }
    EXPECT_EQ(site.min_jacobian, results[i].min_jacobian);
    EXPECT_EQ(site.basis_error, polynomial.basis_error);
    EXPECT_EQ(site.degree, static_cast<uint32_t>(polynomial.degree));
    EXPECT_EQ(site.rank, static_cast<uint32_t>(polynomial.basis.cols()));
    EXPECT_EQ(site.samples, results[i].samples);
    EXPECT_EQ(site.linear_unit, rounded ? linear_unit(polynomial.linear) : 0.0f);
    EXPECT_EQ(site.energy_start, energy);
    EXPECT_EQ(site.coefficients_start, coefficients);
    EXPECT_EQ(site.field_start, field);
    EXPECT_EQ(site.field_start % pack::kAlignment, 0U);
    energy += static_cast<uint64_t>(polynomial.energy.size());
    coefficients += static_cast<uint64_t>(polynomial.coefficients.size());
    field += panels * pack::field_panel_bytes(3 + site.rank, rounded);
  }
  EXPECT_EQ(table.energy()->bytes(), energy * sizeof(double));
  EXPECT_EQ(table.coefficients()->bytes(), coefficients * sizeof(pack::Real));
  EXPECT_EQ(table.field()->bytes(), field);
}

TEST(PackWriter, SitesAdjoin) {
  expect_sites(small_pack_bytes(), small_pack().polynomials, false);
  expect_sites(rounded_pack_bytes(), small_pack().rounded_polynomials(), true);
}

TEST(PackWriter, EstimateOfTheSizeIsNear) {
  const SmallPack& small = small_pack();
  constexpr PolynomialSize kSize = {3, 8};  // for all sites
  std::vector<SiteResult> results = small.polynomials;
  for (SiteResult& result : results) {
    result.polynomial.degree = kSize.degree;
    result.polynomial.energy = Eigen::VectorXd::Zero(pack::num_monomials(2, kSize.degree + 1));
    result.polynomial.basis = Eigen::MatrixXd::Zero(result.polynomial.linear.rows(), kSize.rank);
    result.polynomial.coefficients = Eigen::MatrixXd::Zero(pack::num_monomials(2, kSize.degree), kSize.rank);
  }
  const auto expect_near = [&](bool linear, bool polynomial, bool rounded) {
    PackContent content = small.content();
    if (!linear) content.linear = nullptr;
    content.polynomials = polynomial ? &results : nullptr;
    content.rounded = rounded;
    const double estimate =
        estimate_pack_bytes(small.sites, linear, polynomial ? kSize : PolynomialSize(), rounded);
    const AlignedBytes file = write_pack(content);
    const auto bytes = static_cast<double>(file.bytes().size());
    EXPECT_NEAR(estimate, bytes, 0.02 * bytes) << linear << polynomial << rounded;
  };
  // A percent on a large organ; in this small pack the tables weigh in.
  expect_near(true, true, false);
  expect_near(true, true, true);
  expect_near(true, false, false);
}

TEST(PackWriter, UnreadableInputIsSaid) {
  EXPECT_THROW(read_inputs({"/no/such/file"}), std::runtime_error);
  const TempDir dir;
  const InputFile empty = read_inputs({dir.write("empty.inp", "")}).front();
  EXPECT_EQ(empty.path, "empty.inp");
  EXPECT_EQ(empty.hash, "99aa06d3014798d86001c324468d497f");  // XXH3-128 of no bytes, from its specification
}

}  // namespace pack_writer_test
}  // namespace palpate::test
