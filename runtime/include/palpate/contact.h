/* Contact frames, for a caller with its own contact search: displacements of sites in, forces out. */
#ifndef PALPATE_CONTACT_H
#define PALPATE_CONTACT_H

#include <palpate/session.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The patch of a site, held and moved as one body. Along each axis of the organ frame the caller gives either
 * the displacement or the force, and the other number is ignored. A contact between sites answers as the mean
 * of the three sites at the corners of its triangle, with its weights. This struct does not grow. */
typedef struct pal_contact {
  uint32_t site;
  double displacement[3];      /* displacement of the patch from rest: m */
  uint32_t force_axes;         /* bit 0, 1, 2: the force is given along x, y, z; else the displacement */
  double force[3];             /* force of the tool on the tissue: N */
  uint32_t neighbours[2];      /* sites of the other two corners; any site if the weight is 0 */
  double neighbour_weights[2]; /* >= 0, sum <= 1; `site` has the remaining weight. 0, 0: at `site` */
} pal_contact;

/* The contact at a surface point, moved by `displacement` (m). */
static inline pal_contact pal_contact_at(const pal_surface_point* point,
                                         const double displacement[3]) PAL_NOEXCEPT {
  pal_contact contact = PAL_ZERO;
  contact.site = point->sites[0];
  for (int i = 0; i < 3; ++i) contact.displacement[i] = displacement[i];
  for (int i = 0; i < 2; ++i) {
    contact.neighbours[i] = point->sites[i + 1];
    contact.neighbour_weights[i] = point->weights[i + 1];
  }
  return contact;
}

/* The answer to one contact, organ frame. This struct does not grow. */
typedef struct pal_contact_result {
  double force[3];        /* force that the tool must apply to the tissue: N. A device plays its negative */
  double displacement[3]; /* displacement of the patch, as given or by the given force: m */
  /* d force / d displacement of this contact, with the others held: N/m, symmetric. The stiffness of
   * nonlinear_zone is up to PAL_ZONE_STIFFNESS_FRAMES frames old. */
  double stiffness[3][3];
  pal_model model; /* model that answered */
  uint32_t flags;  /* PAL_FLAG_... */
  /* Estimated bound of 95 % of the errors: largest error of any shown node over |displacement|. 1: unknown */
  double displacement_error;
  double force_error; /* the same of |error of force| / |force|. 1: unknown */
} pal_contact_result;

/* Computes forces and stiffness for exactly these contacts [count], without blending and limits. Count 0: no
 * contacts; `contacts` may then be NULL. Contacts that tools hold come back with the next haptic frame.
 * `results`: [count], may be NULL. Real-time safe: yes; docs/embedding.md has the cost. */
PAL_NODISCARD PAL_API pal_status pal_contact_frame(pal_session* session, const pal_contact* contacts,
                                                   uint32_t count, pal_contact_result* results) PAL_NOEXCEPT;

/* Turns the patches of contacts 0 .. count - 1 about their points in later contact frames, and no others.
 * `orientations`: [count][4] unit quaternions w, x, y, z, organ frame, at most a quarter turn; may be NULL if
 * count is 0. PAL_STATUS_NO_SUCH_MODEL: pal_session_config::patches_turn is 0. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_set_orientations(pal_session* session,
                                                              const double* orientations,
                                                              uint32_t count) PAL_NOEXCEPT;

/* The torque of one contact, organ frame. pal_contact_result::stiffness, by_displacement with its transpose,
 * and by_rotation form the 6 x 6 stiffness. Rotations are small, about the axes of the frame. */
typedef struct pal_contact_torque {
  uint32_t struct_size;
  uint32_t reserved;            /* 0 */
  double torque[3];             /* torque about the displaced point of the patch: N m */
  double by_displacement[3][3]; /* d torque / d displacement: N */
  double by_rotation[3][3];     /* d torque / d rotation: N m; symmetric where the torque is zero */
} pal_contact_torque;

/* Returns the torque of a contact of the last frame. PAL_STATUS_MODEL_CANNOT_ANSWER: the last frame was not a
 * contact frame answered by nonlinear_zone. PAL_STATUS_BAD_ARGUMENT: the frame had no such contact. Set
 * torque->struct_size first. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_get_torque(const pal_session* session, uint32_t contact,
                                                        pal_contact_torque* torque) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_CONTACT_H */
