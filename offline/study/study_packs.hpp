// Packs of other settings than the scene's, at few of its sites: what they would give is compared with what it has.
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
  std::string setting;  // what is other about it: "degree 5, rank 20, int16"
  AlignedBytes bytes;
  OpenedPack opened;

  StudyPack(std::string what, AlignedBytes made)
      : setting(std::move(what)), bytes(std::move(made)), opened(bytes) {}
};

// "degree 5, rank 20, int16": the largest of any site. The pack carries polynomial_dd.
std::string polynomial_setting(const OpenedPack& opened);

// polynomial_dd at all sites of the organ, a pack for each setting, all of the same samples: as many as degree 7
// needs, or more. `store`: of the organ's samples, as BuildInputs::store.
std::vector<std::unique_ptr<StudyPack>> make_polynomial_packs(const Organ& organ, int jobs,
                                                              std::vector<PolynomialSetting> settings,
                                                              const SampleStore* store);

// Moved polynomials: at all sites of `study`, some of the organ's, a polynomial moved there from another one of its
// sites, one edge away and two, by each map, a pack for each; "rigid, from 1 edge". Where sites are too few or too
// far apart for that: a note. `store`: as above.
std::vector<std::unique_ptr<StudyPack>> make_moved_packs(const Organ& organ, const Organ& study, int jobs,
                                                         const SampleStore* store,
                                                         std::vector<std::string>& notes);

// As many rings, up to `most`, as take no more than 256 MB of a pack of nonlinear_zone at all sites of the organ, of so
// many contacts.
int rings_of_zone_pack(const Organ& organ, int most, int contacts);

// That pack, of so many rings, without a survey. Cost: as `palpate build` takes for zones; for several contacts, with
// all pairs.
std::unique_ptr<StudyPack> make_zone_pack(const Organ& organ, int jobs, int rings, int contacts);

}  // namespace palpate
