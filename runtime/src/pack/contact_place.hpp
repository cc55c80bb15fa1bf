// The place of a contact: a site, or a point of the surface between up to three sites.
//
// The answer at a point is f = sum_i w_i f_i(d), with the barycentric weights w of the point. f_i(d) are the
// answers of its triangle's corners to the displacement d. Energy, stiffness and field follow the same sum.
// - Weights are continuous over the surface, because a corner's weight is zero on the opposite edge. So
//   displacement and force are continuous as a contact slides.
// - At a fixed point the force is the gradient of an energy.
#pragma once

#include <math.h>

#include <palpate/palpate.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"

namespace palpate {

struct Corner {
  uint32_t site;
  double weight;
};

inline constexpr uint32_t kMostCorners = 4;

// Weights > 0 of up to three corners, with sum 1; or the weights of a difference (difference_from()).
struct ContactPlace {
  uint32_t count;
  Corner corners[kMostCorners];
};

// The site's own weight: 1 less the neighbours' weights. All callers need the same rounding, because a site
// of weight zero may be any number.
inline double own_weight(const pal_contact& contact) {
  return 1.0 - (contact.neighbour_weights[0] + contact.neighbour_weights[1]);
}

// Whether the contact's place lies on this pack's surface.
inline pal_status check_place(const pal_pack& pack, const pal_contact& contact) {
  constexpr double kRounding = 1e-6;
  const double* others = contact.neighbour_weights;
  if (!isfinite(others[0]) || !isfinite(others[1])) return PAL_STATUS_NOT_FINITE;
  if (others[0] < 0 || others[1] < 0 || own_weight(contact) < -kRounding) return PAL_STATUS_BAD_ARGUMENT;
  for (int i = 0; i < 2; ++i) {
    if (others[i] > 0 && contact.neighbours[i] >= pack.num_sites) return PAL_STATUS_NO_SUCH_SITE;
  }
  return own_weight(contact) > 0 && contact.site >= pack.num_sites ? PAL_STATUS_NO_SUCH_SITE : PAL_STATUS_OK;
}

inline bool is_at_site(const pal_contact& contact) {
  return !(contact.neighbour_weights[0] > 0) && !(contact.neighbour_weights[1] > 0);
}

// The corners with nonzero weights, which sum to 1.
inline ContactPlace place_of(const pal_contact& contact) {
  if (is_at_site(contact)) return {1, {{contact.site, 1.0}}};
  const double* others = contact.neighbour_weights;
  const Corner all[3] = {{contact.site, own_weight(contact)},
                         {contact.neighbours[0], others[0]},
                         {contact.neighbours[1], others[1]}};
  ContactPlace place = {};
  double sum = 0;
  for (const Corner& corner : all) {
    if (!(corner.weight > 0)) continue;
    place.corners[place.count++] = corner;
    sum += corner.weight;
  }
  for (uint32_t i = 0; i < place.count; ++i) place.corners[i].weight /= sum;
  return place;
}

// The difference of a place and a site: weights of up to four corners, with sum 0. Empty if both are equal.
inline ContactPlace difference_from(const ContactPlace& place, uint32_t site) {
  ContactPlace difference = {};
  double site_weight = -1;
  for (uint32_t i = 0; i < place.count; ++i) {
    if (place.corners[i].site == site) {
      site_weight += place.corners[i].weight;
    } else {
      difference.corners[difference.count++] = place.corners[i];
    }
  }
  if (difference.count > 0) difference.corners[difference.count++] = {site, site_weight};
  return difference;
}

// The site of the largest weight.
inline uint32_t nearest_site(const pal_contact& contact) {
  const double* others = contact.neighbour_weights;
  const double own = own_weight(contact);
  if (others[0] > own && others[0] >= others[1]) return contact.neighbours[0];
  return others[1] > own ? contact.neighbours[1] : contact.site;
}

// Whether the site has nearly the largest weight. A contact that trembles between two sites keeps its site.
inline bool is_about_nearest(const pal_contact& contact, uint32_t site) {
  constexpr double kHysteresis = 0.1;
  const ContactPlace place = place_of(contact);
  double site_weight = 0;
  double largest = 0;
  for (uint32_t i = 0; i < place.count; ++i) {
    site_weight += place.corners[i].site == site ? place.corners[i].weight : 0.0;
    largest = std::max(largest, place.corners[i].weight);
  }
  return site_weight >= largest - kHysteresis;
}

}  // namespace palpate
