/* A pack: one organ as `palpate build` wrote it. An open pack is constant; sessions and threads share it. */
#ifndef PALPATE_PACK_H
#define PALPATE_PACK_H

#include <palpate/status.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Response models. docs/response_models.md helps to choose, and states the error of each model. */
typedef enum pal_model {
  /* the first model that can answer: polynomial_dd or affine_site, then nonlinear_zone, then linear_dd */
  PAL_MODEL_AUTO = 0,
  PAL_MODEL_LINEAR = 1, /* linear_dd: any contacts, any nodes fixed at run time */
  /* polynomial_dd: nonlinear, one contact; affine_site answers at sites without samples */
  PAL_MODEL_POLYNOMIAL = 2,
  /* nonlinear_zone: nonlinear, up to 8 contacts and 32 fixed nodes; depends on past frames */
  PAL_MODEL_ZONE = 3,
  PAL_MODEL_AFFINE = 4 /* affine_site: as polynomial_dd, from exact derivatives at rest */
} pal_model;

typedef struct pal_pack pal_pack; /* opaque; lives in storage of the caller */

enum {
  PAL_PACK_STORAGE_BYTES = 2048,
  PAL_ZONE_STIFFNESS_FRAMES = 24 /* largest age of the stiffness of nonlinear_zone, in frames */
};

typedef enum pal_verify {
  PAL_VERIFY_ONCE = 0, /* checks everything: tables, indices, numbers, checksum of the whole file */
  /* Checks only tables, sizes and indices. A pack damaged after `palpate verify` may give wrong or non-finite
   * forces, but causes no access outside the pack. */
  PAL_VERIFY_NEVER = 1
} pal_verify;

/* Maps a file read-only and checks it. `storage`: PAL_PACK_STORAGE_BYTES bytes, aligned to 16, in use until
 * pal_pack_close. Replace a mapped file only by renaming (docs/embedding.md). Real-time safe: no. */
PAL_NODISCARD PAL_API pal_status pal_pack_open(const char* path, pal_verify verify, void* storage,
                                               size_t storage_bytes, pal_pack** pack) PAL_NOEXCEPT;

/* Opens a pack in `bytes`, aligned to 64, which must outlive the pack and not change. Real-time safe: no. */
PAL_NODISCARD PAL_API pal_status pal_pack_open_memory(const void* bytes, size_t num_bytes, pal_verify verify,
                                                      void* storage, size_t storage_bytes,
                                                      pal_pack** pack) PAL_NOEXCEPT;

/* Unmaps the file. Do not use a session on the pack afterwards. `pack` may be NULL. Real-time safe: no. */
PAL_API void pal_pack_close(pal_pack* pack) PAL_NOEXCEPT;

typedef struct pal_pack_info {
  uint32_t struct_size;
  uint32_t num_nodes; /* packed nodes: the rows of pal_visual_frame */
  uint32_t num_triangles;
  uint32_t num_sites;         /* places where a tool can take hold */
  uint32_t num_contact_nodes; /* nodes that can be held or fixed */
  uint32_t max_patch_nodes;   /* largest number of nodes in the patch of any site */
  uint32_t max_contacts;      /* the scene's largest number of simultaneous contacts */
  uint32_t has_linear;        /* 1: the pack carries the model */
  uint32_t has_polynomial;
  uint32_t polynomial_degree;    /* highest degree of any site's displacement field; 0 without the model */
  uint32_t has_units;            /* 1: this API speaks metres and newtons; 0: the model's own units */
  double metres_per_length_unit; /* 1 without units */
  double newtons_per_force_unit; /* 1 without units */
  double max_displacement;       /* the scene's largest displacement: m */
  double tip_radius;             /* a patch holds the surface nodes within this distance of its site: m */
  double mean_surface_edge;      /* m */
  double gravity[3];             /* the scene's gravity, organ frame: m/s^2; 0 without gravity */
  uint32_t has_gravity;
  uint32_t gravity_may_turn; /* 1: the pack allows pal_session_set_gravity */
  uint32_t zone_rings;       /* rings of elements of nonlinear_zone; 0 without the model */
  uint32_t reserved;         /* 0 */
} pal_pack_info;

/* Set info->struct_size first. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_pack_get_info(const pal_pack* pack, pal_pack_info* info) PAL_NOEXCEPT;

/* The packed geometry, in the model's length unit. Its pointers are valid until pal_pack_close. */
typedef struct pal_geometry {
  uint32_t struct_size;
  uint32_t num_nodes;
  uint32_t num_triangles;
  const int32_t* labels;        /* [num_nodes] node labels of the model file, ascending */
  const double* positions;      /* [num_nodes][3] nodes of the mesh */
  const uint32_t* triangles;    /* [num_triangles][3] nodes, counter-clockwise from outside */
  const double* rest_positions; /* [num_nodes][3] nodes at rest under gravity; without gravity `positions` */
} pal_geometry;

/* Set geometry->struct_size first. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_pack_get_geometry(const pal_pack* pack,
                                                       pal_geometry* geometry) PAL_NOEXCEPT;

/* Finds the site at the node with this label in the model file. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_pack_find_site(const pal_pack* pack, int32_t node_label,
                                                    uint32_t* site) PAL_NOEXCEPT;

/* Finds the contact node (for pal_session_set_fixed) with this label. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_pack_find_contact_node(const pal_pack* pack, int32_t node_label,
                                                            uint32_t* contact_node) PAL_NOEXCEPT;

/* Finds the packed node at the centre of a site. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_pack_get_site_node(const pal_pack* pack, uint32_t site,
                                                        uint32_t* node) PAL_NOEXCEPT;

/* Returns the bytes of the pack, for mlock or for programs that read the tables. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_pack_get_bytes(const pal_pack* pack, const void** bytes,
                                                    size_t* num_bytes) PAL_NOEXCEPT;

/* A surface point, as weights of the sites at the corners of its triangle. This struct does not grow. */
typedef struct pal_surface_point {
  uint32_t sites[3];
  uint32_t reserved;  /* 0 */
  double weights[3];  /* >= 0, with sum 1 */
  double position[3]; /* at rest, organ frame: m */
  double normal[3];   /* unit, out of the tissue */
  double distance;    /* signed distance of the given position: m; negative inside the tissue */
} pal_surface_point;

/* Finds the nearest touchable point of the surface at rest. `position`: organ frame, m, within 1e15 length
 * units. The sign of `distance` is right if no other part of the surface is nearer.
 * PAL_STATUS_NO_SUCH_MODEL: the pack has no surface tree. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_pack_find_surface_point(const pal_pack* pack, const double position[3],
                                                             pal_surface_point* point) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_PACK_H */
