// Random sets of several contacts, and their truths: what a survey of several contacts at once is made of.
//
// A pack says of four kinds of sets how wrong its answers to them are, as what contacts add to each other depends on
// how near they are: neighbours that move against each other strain what is between them many times as much as one
// alone does. No two contacts of a set hold the same node.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/precompute/contact_truth.hpp"
#include "offline/precompute/sampling.hpp"

namespace palpate {

enum class SetKind {
  two_near,      // a site and the nearest whose patch shares no node with its own
  two_anywhere,  // two random ones
  three_near,    // a site and the two nearest
  three_apart,   // of eight random threes the one whose nearest two are farthest apart
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

// Sets and their truths, in the same order.
struct SolvedSets {
  std::vector<ContactSet> sets;
  std::vector<ContactTruth> truths;
  SolveCounts counts;  // of this process
};

// The first of these sites whose patches share no node; empty where there are fewer than `count`.
std::vector<size_t> first_apart(const ContactSites& sites, const std::vector<size_t>& order, size_t count);

// `count` of them, as many of each kind that the scene's max_contacts leaves; fewer, or none, where patches overlap
// too much. Each contact in a random direction by up to the scene's max_displacement, all sizes with the same chance.
// The same seed gives the same sets.
std::vector<ContactSet> draw_contact_sets(const Model& model, const Scene& scene, const ContactSites& sites,
                                          int count, std::uint64_t seed);

// Their truths. What `store` has is not solved again, and what is solved is kept; null: nothing is. Fields are right
// to single precision. Neither `jobs` nor the store changes a digit. `progress` gets sets done, total, never from two
// threads at once. `next` hands out sets as in sample_sites(); those that others get come back unsolved.
SolvedSets solve_drawn_sets(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                            std::vector<ContactSet> sets, int jobs, const SampleStore* store,
                            const std::function<void(int, int)>& progress,
                            const std::function<size_t()>& next = {});

}  // namespace palpate
