// Draws and solves random sets of several contacts for the survey.
//
// Interaction of contacts depends on their distance: opposed neighbours strain the tissue between them far
// more than a single contact. A survey therefore separates four kinds of sets. Contacts share no node.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/precompute/contact_truth.hpp"
#include "offline/precompute/sampling.hpp"

namespace palpate {

enum class SetKind {
  two_near,      // a site and the nearest site with a disjoint patch
  two_anywhere,  // two random sites
  three_near,    // a site and the two nearest sites
  three_apart,   // the most distant of eight random triples
};

inline constexpr SetKind kSetKinds[] = {SetKind::two_near, SetKind::two_anywhere, SetKind::three_near,
                                        SetKind::three_apart};

constexpr int num_contacts_of(SetKind kind) {
  return kind == SetKind::two_near || kind == SetKind::two_anywhere ? 2 : 3;
}
constexpr bool is_near(SetKind kind) {
  return kind == SetKind::two_near || kind == SetKind::three_near;
}
const char* words_for(SetKind kind);  // "2 near", ...

struct ContactSet {
  SetKind kind = SetKind::two_near;
  std::vector<LinearContact> contacts;
};

// Sets and their full nonlinear solutions, in the same order.
struct SolvedSets {
  std::vector<ContactSet> sets;
  std::vector<ContactTruth> truths;
  SolveCounts counts;  // counts of this process
};

// Picks the first `count` sites of `order` that share no node with earlier picks; empty where fewer exist.
std::vector<size_t> first_apart(const ContactSites& sites, const std::vector<size_t>& order, size_t count);

// Draws `count` sets, equally many of each kind that max_contacts permits. Returns fewer sets where patches
// overlap. Directions are random, sizes uniform up to max_displacement. Equal seeds give equal sets.
std::vector<ContactSet> draw_contact_sets(const Model& model, const Scene& scene, const ContactSites& sites,
                                          int count, std::uint64_t seed);

// Solves the sets. `store` (null: none) supplies and keeps solves; fields have single precision. The digits
// depend neither on `jobs` nor on the store. `progress` gets done and total sets, from one thread at a time.
// `next` hands out sets as in sample_sites(); sets of other processes return unsolved.
SolvedSets solve_drawn_sets(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                            std::vector<ContactSet> sets, int jobs, const SampleStore* store,
                            const std::function<void(int, int)>& progress,
                            const std::function<size_t()>& next = {});

}  // namespace palpate
