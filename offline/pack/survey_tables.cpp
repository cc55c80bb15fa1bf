#include <stdexcept>
#include "offline/pack/frame_cost.hpp"
#include "offline/pack/pack_tables.hpp"

namespace palpate {
namespace {

flatbuffers::Offset<pack::ErrorBin> table_of(const SurveyBin& bin, flatbuffers::FlatBufferBuilder& builder) {
  return pack::CreateErrorBin(builder, bin.from, bin.to, static_cast<uint32_t>(bin.samples),
                              bin.displacement.median, bin.displacement.p95, bin.displacement.max,
                              bin.force.median, bin.force.p95, bin.force.max, bin.displacement.bound,
                              bin.force.bound, bin.displacement.growth, bin.force.growth);
}

pack::SetErrors packed(const SetKindErrors& errors) {
  return {static_cast<uint32_t>(num_contacts_of(errors.kind)),
          is_near(errors.kind) ? 1u : 0u,
          static_cast<uint32_t>(errors.sets),
          static_cast<uint32_t>(errors.unsolved),
          static_cast<uint32_t>(errors.flagged),
          0,
          errors.displacement.median,
          errors.displacement.p95,
          errors.displacement.max,
          errors.force.median,
          errors.force.p95,
          errors.force.max};
}

pack::ResponseModel schema_model(SurveyedModel model) {
  switch (model) {
    case SurveyedModel::linear_dd:
      return pack::ResponseModel::linear_dd;
    case SurveyedModel::polynomial_dd:
      return pack::ResponseModel::polynomial_dd;
    case SurveyedModel::nonlinear_zone:
      return pack::ResponseModel::nonlinear_zone;
    case SurveyedModel::affine_site:
      return pack::ResponseModel::affine_site;
    case SurveyedModel::unrefined_zone:
      return pack::ResponseModel::unrefined_zone;
  }
  throw std::logic_error("no such model");
}

}  // namespace

std::vector<flatbuffers::Offset<pack::ErrorSurvey>> create_surveys(const PackContent& content,
                                                                   flatbuffers::FlatBufferBuilder& builder) {
  std::vector<flatbuffers::Offset<pack::ErrorSurvey>> surveys;
  for (const ModelSurvey& survey : content.surveys) {
    std::vector<flatbuffers::Offset<pack::ErrorBin>> bins;
    for (const SurveyBin& bin : survey.table.bins) bins.push_back(table_of(bin, builder));
    const auto overall = table_of(survey.table.overall, builder);
    std::vector<pack::SetErrors> sets;
    uint32_t most_contacts = 0;
    for (const SetKindErrors& kind : survey.sets.kinds) {
      sets.push_back(packed(kind));
      most_contacts = std::max(most_contacts, sets.back().contacts());
    }
    // Without unflagged responses the runtime has no data for an estimate at sets.
    if (!(survey.sets.over_load.displacement > 0)) most_contacts = 0;
    surveys.push_back(pack::CreateErrorSurveyDirect(
        builder, schema_model(survey.model), &bins, overall, sets.empty() ? nullptr : &sets, most_contacts,
        survey.sets.over_load.displacement, survey.sets.over_load.force, survey.table.force_scale,
        survey.sets.over_reach.displacement, survey.sets.over_reach.force));
  }
  return surveys;
}

std::vector<flatbuffers::Offset<pack::FrameCost>> create_costs(const PackContent& content,
                                                               flatbuffers::FlatBufferBuilder& builder) {
  std::vector<flatbuffers::Offset<pack::FrameCost>> costs;
  for (const FrameCost& cost : count_frame_costs(content)) {
    costs.push_back(pack::CreateFrameCost(builder, schema_model(cost.model), cost.force_operations,
                                          cost.force_bytes, cost.field_operations, cost.field_bytes));
  }
  return costs;
}

}  // namespace palpate
