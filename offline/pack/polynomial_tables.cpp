#include "offline/pack/pack_tables.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

void append_bytes(const void* data, size_t count, std::vector<unsigned char>& bytes) {
  const auto* from = static_cast<const unsigned char*>(data);
  bytes.insert(bytes.end(), from, from + count);
}

// Appends the coefficients of the energy for divided monomials x^a/a! y^b/b! z^c/c!.
void append_energy(const SitePolynomial& polynomial, std::vector<double>& energy) {
  const auto factorial = [](uint32_t n) {
    double product = 1;
    for (uint32_t i = 2; i <= n; ++i) product *= i;
    return product;
  };
  const Eigen::Index skipped = pack::monomial_start(2);
  pack::for_each_monomial(static_cast<uint32_t>(polynomial.degree) + 1, [&](Eigen::Index index, uint32_t a,
                                                                            uint32_t b, uint32_t c) {
    if (index < skipped) return;
    energy.push_back(factorial(a) * factorial(b) * factorial(c) * polynomial.energy[index - skipped]);
  });
}

}  // namespace

PolynomialSegments add_polynomials(const std::vector<SiteResult>& results, const ContactSites& contact_sites,
                                   bool rounded, SegmentStore& store) {
  std::vector<pack::PolynomialSite> sites;
  std::vector<double> energy;
  std::vector<pack::Real> coefficients;
  std::vector<unsigned char> field;
  const size_t panels = num_panels(contact_sites);
  for (const SiteResult& result : results) {
    const SitePolynomial& polynomial = result.polynomial;
    pack::PolynomialSite site = {};
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(site.to_unit) = polynomial.to_unit;
    site.min_jacobian = result.min_jacobian;
    site.basis_error = polynomial.basis_error;
    site.energy_start = energy.size();
    site.coefficients_start = coefficients.size();
    site.field_start = field.size();
    site.degree = static_cast<std::uint32_t>(polynomial.degree);
    site.rank = static_cast<std::uint32_t>(polynomial.basis.cols());
    site.samples = static_cast<std::uint32_t>(result.samples);
    if (rounded) site.linear_unit = linear_unit(polynomial.linear);
    sites.push_back(site);
    append_energy(polynomial, energy);
    const std::vector<double> rows = by_rows(polynomial.coefficients);
    for (const double number : rows) coefficients.push_back(static_cast<pack::Real>(number));
    Eigen::MatrixXd columns(polynomial.linear.rows(), 3 + polynomial.basis.cols());
    columns << polynomial.linear, polynomial.basis;
    Eigen::VectorXd units = Eigen::VectorXd::Ones(columns.cols());
    units.head<3>().setConstant(static_cast<double>(site.linear_unit));
    std::vector<std::int16_t> integers;
    std::vector<pack::Real> reals;
    for (size_t panel = 0; panel < panels; ++panel) {
      if (rounded)
        append_rounded_panel(columns, units, panel, integers);
      else
        append_panel(columns, panel, reals);
    }
    append_bytes(integers.data(), integers.size() * sizeof integers[0], field);
    append_bytes(reals.data(), reals.size() * sizeof reals[0], field);
  }
  return {store.add(sites), store.add(energy), store.add(coefficients), store.add(field)};
}

flatbuffers::Offset<pack::PolynomialDd> create_polynomials(const PackContent& content,
                                                           const PolynomialSegments& polynomial,
                                                           uint64_t base,
                                                           flatbuffers::FlatBufferBuilder& builder) {
  const pack::Segment sites_at = placed(polynomial.sites, base);
  const pack::Segment energy = placed(polynomial.energy, base);
  const pack::Segment coefficients = placed(polynomial.coefficients, base);
  const pack::Segment field = placed(polynomial.field, base);
  return pack::CreatePolynomialDd(builder, static_cast<uint32_t>(highest_degree(*content.polynomials)),
                                  content.rounded ? pack::FieldPrecision::i16 : pack::FieldPrecision::real,
                                  &sites_at, &energy, &coefficients, &field);
}

}  // namespace palpate
