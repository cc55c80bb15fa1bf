// What a compressed compliance costs in accuracy: the runtime's answers against exact linear ones.
#pragma once

#include "offline/fem/assembly.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_sites.hpp"

namespace palpate {

// The largest over all samples.
struct ComplianceErrors {
  int samples = 0;
  double displacement = 0;  // of any packed node, as part of the largest |d| of the contacts
  double force = 0;         // of any contact, as part of the largest of them
};

// Sets of 1, 2, ... `max_contacts` contacts at random sites, the same ones each time. The pack carries
// linear_dd.
ComplianceErrors measure_compliance(const OpenedPack& opened, const Assembly& assembly,
                                    const ContactSites& sites, const RestState& rest, int max_contacts);

}  // namespace palpate
