#include "offline/pack/pack_tables.hpp"

namespace palpate {
namespace {

// Lists the lower triangle as 3 x 3 blocks, row by row.
std::vector<double> lower_blocks(const Eigen::MatrixXd& symmetric) {
  std::vector<double> blocks;
  const Eigen::Index num_nodes = symmetric.rows() / 3;
  blocks.reserve(9 * pack::lower_block(static_cast<uint64_t>(num_nodes), 0));
  for (Eigen::Index i = 0; i < num_nodes; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      for (Eigen::Index entry = 0; entry < 9; ++entry)
        blocks.push_back(symmetric(3 * i + entry / 3, 3 * j + entry % 3));
    }
  }
  return blocks;
}

// Lists the three columns of each contact node, panel by panel.
std::vector<pack::Real> field_columns(const Eigen::MatrixXd& columns, size_t panels) {
  std::vector<pack::Real> field;
  field.reserve(panels * pack::kPanelRows * static_cast<size_t>(columns.cols()));
  for (Eigen::Index node = 0; node < columns.cols() / 3; ++node) {
    for (size_t panel = 0; panel < panels; ++panel)
      append_panel(columns.middleCols<3>(3 * node), panel, field);
  }
  return field;
}

// Returns patch_forces() of each site, row by row; `compliance_of(site)` is the compliance of the patch.
template <typename ComplianceOf>
std::vector<double> forces_of_sites(const ContactSites& sites, ComplianceOf&& compliance_of) {
  std::vector<double> forces;
  for (const ContactSite& site : sites.sites) {
    const std::vector<double> rows = by_rows(patch_forces(compliance_of(site)));
    forces.insert(forces.end(), rows.begin(), rows.end());
  }
  return forces;
}

}  // namespace

LinearSegments add_linear(const LinearDd& linear, const ContactSites& sites, SegmentStore& store) {
  return {store.add(lower_blocks(linear.contact_compliance)),
          store.add(field_columns(linear.field_compliance, num_panels(sites))),
          {}};
}

CompressedSegments add_compressed(const CompressedCompliance& compressed, SegmentStore& store) {
  return {store.add(compressed.panels), store.add(compressed.node_places), store.add_reals(compressed.basis),
          store.add(compressed.blocks), store.add_reals(compressed.coefficients)};
}

std::vector<double> site_forces(const PackContent& content) {
  if (content.compressed != nullptr) {
    return forces_of_sites(content.sites, [&](const ContactSite& site) {
      return patch_compliance(*content.compressed, content.sites, site);
    });
  }
  return forces_of_sites(content.sites, [&](const ContactSite& site) -> Eigen::MatrixXd {
    const std::vector<Eigen::Index> dofs = patch_dofs(site);
    return content.linear->contact_compliance(dofs, dofs);
  });
}

flatbuffers::Offset<pack::LinearDd> create_linear(const PackContent& content, const LinearSegments& linear,
                                                  const CompressedSegments& compressed, uint64_t base,
                                                  flatbuffers::FlatBufferBuilder& builder) {
  const pack::Segment forces_of_sites = placed(linear.site_forces, base);
  if (content.linear != nullptr) {
    const pack::Segment contact_compliance = placed(linear.contact_compliance, base);
    const pack::Segment field_compliance = placed(linear.field_compliance, base);
    return pack::CreateLinearDd(builder, &contact_compliance, &field_compliance, 0, &forces_of_sites);
  }
  if (content.compressed != nullptr) {
    const pack::Segment panels = placed(compressed.panels, base);
    const pack::Segment node_places = placed(compressed.node_places, base);
    const pack::Segment basis = placed(compressed.basis, base);
    const pack::Segment blocks = placed(compressed.blocks, base);
    const pack::Segment coefficients = placed(compressed.coefficients, base);
    const auto compressed_table = pack::CreateCompressedCompliance(
        builder, static_cast<uint32_t>(content.compressed->panels.size()), &panels, &node_places, &basis,
        &blocks, &coefficients, content.compressed->tolerance, content.compressed->displacement_error,
        content.compressed->force_error, static_cast<uint32_t>(content.compressed->samples));
    return pack::CreateLinearDd(builder, nullptr, nullptr, compressed_table, &forces_of_sites);
  }
  return {};
}

}  // namespace palpate
