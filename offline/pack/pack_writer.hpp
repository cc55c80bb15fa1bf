// Writes the results of precompute as a pack: the bytes that schemas/ describes.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "offline/pack/input_files.hpp"
#include "offline/precompute/compressed_compliance.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/nonlinear_zone.hpp"
#include "offline/precompute/set_survey.hpp"
#include "offline/precompute/site_survey.hpp"

namespace palpate {

// The models with measured errors. unrefined_zone: nonlinear_zone before exterior iterations.
enum class SurveyedModel { linear_dd, polynomial_dd, nonlinear_zone, affine_site, unrefined_zone };
struct ModelSurvey {
  SurveyedModel model;
  SurveyTable table;
  SetSurvey sets = {};  // errors of several contacts; empty where the model supports one contact
};

// The content of a pack. The references must outlive the call that reads them.
struct PackContent {
  const Model& model;
  const Scene& scene;
  const ContactSites& sites;
  const LinearDd* linear = nullptr;  // null: absent, or compressed
  const std::vector<SiteResult>* polynomials = nullptr;
  bool rounded = false;  // polynomial columns are written as int16
  std::vector<InputFile> inputs;
  std::vector<ModelSurvey> surveys;
  const RestState* rest = nullptr;                   // null, or the mesh: no gravity
  const CompressedCompliance* compressed = nullptr;  // linear_dd of a large surface, in place of `linear`
  const ZoneTables* zone = nullptr;                  // null: absent; needs `linear` or `compressed`
  bool has_linear() const { return linear != nullptr || compressed != nullptr; }
};

// Bytes on a 64-byte boundary, so that the runtime can open a pack in memory.
class AlignedBytes {
 public:
  explicit AlignedBytes(size_t size);
  std::span<unsigned char> bytes() { return {data_.get(), size_}; }
  std::span<const unsigned char> bytes() const { return {data_.get(), size_}; }

 private:
  struct Release {
    void operator()(unsigned char* data) const;
  };
  std::unique_ptr<unsigned char, Release> data_;
  size_t size_;
};

// Writes the pack. Equal content gives equal bytes. Cost: about twice the pack in memory.
AlignedBytes write_pack(const PackContent& content);

// Returns the largest degree of any site; 0 without polynomials.
int highest_degree(const std::vector<SiteResult>& results);

// Size of the polynomial of each site; degree 0: no polynomials.
struct PolynomialSize {
  std::uint32_t degree = 0;
  std::uint32_t rank = 0;
};

// Estimates the bytes of write_pack() without input files from counts; roughly for a compliance that is
// compressed to a tolerance. `tolerance`: 0 where it is dense.
double estimate_pack_bytes(const ContactSites& sites, bool linear, PolynomialSize polynomials, bool rounded,
                           double tolerance = 0);

}  // namespace palpate
