// Makes packs with other settings than the scene's, at a few of its sites, for comparison.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/site_survey.hpp"

namespace palpate {

// A pack that stays open.
struct StudyPack {
  std::string setting;  // the difference from the scene: "degree 5, rank 20, int16"
  AlignedBytes bytes;
  OpenedPack opened;

  StudyPack(std::string what, AlignedBytes made)
      : setting(std::move(what)), bytes(std::move(made)), opened(bytes) {}
};

// Returns "degree 5, rank 20, int16", the largest values of any site. The pack must carry polynomial_dd.
std::string polynomial_setting(const OpenedPack& opened);

// Makes polynomial_dd packs at all sites of the organ, one pack for each setting. All packs share samples
// that suffice for degree 7. `store`: samples of the organ, as in BuildInputs::store.
std::vector<std::unique_ptr<StudyPack>> make_polynomial_packs(const Organ& organ, int jobs,
                                                              std::vector<PolynomialSetting> settings,
                                                              const SampleStore* store);

// Makes packs of transferred polynomials ("rigid, from 1 edge"), one for each map and distance. Every site of
// `study` receives the polynomial of another site of the organ, one or two edges away. Adds a note where such
// sites are missing. `store`: as above.
std::vector<std::unique_ptr<StudyPack>> make_transferred_packs(const Organ& organ, const Organ& study,
                                                               int jobs, const SampleStore* store,
                                                               std::vector<std::string>& notes);

// Makes a zone pack with `rings` rings and without a survey. Cost: as in `palpate build`.
std::unique_ptr<StudyPack> make_zone_pack(const Organ& organ, int rings);

}  // namespace palpate
