// Measures the error of a compressed compliance: the runtime's responses against exact linear responses.
#pragma once

#include "offline/fem/assembly.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_sites.hpp"

namespace palpate {

// The largest errors over all samples.
struct ComplianceErrors {
  int samples = 0;
  double displacement = 0;  // largest over packed nodes, relative to the largest |d| of the contacts
  double force = 0;         // largest over contacts, relative to the largest force
};

// Compares responses at random sets of 1, 2, ... `max_contacts` contacts, from a fixed seed. Needs linear_dd.
ComplianceErrors measure_compliance(const OpenedPack& opened, const Assembly& assembly,
                                    const ContactSites& sites, const RestState& rest, int max_contacts);

}  // namespace palpate
