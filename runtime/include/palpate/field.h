/* Displacements and normals for drawing, at the nodes that the scene shows. */
#ifndef PALPATE_FIELD_H
#define PALPATE_FIELD_H

#include <palpate/session.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The type of displacement fields; all other numbers are double. A library built with PALPATE_FLOAT64=1 has
 * double fields, opens only packs of such builders, and needs the same definition in its callers. */
#if defined(PALPATE_FLOAT64) && PALPATE_FLOAT64
typedef double pal_real;
/* With these names, a caller without the definition does not link. */
#define pal_visual_frame pal_visual_frame_float64
#define pal_pack_compute_normals pal_pack_compute_normals_float64
#else
typedef float pal_real;
#endif

/* Writes displacements of all packed nodes under the contacts of the last completed frame: from
 * pal_geometry::positions, gravity's included, organ frame, m. Node i's three numbers are at
 * (char*)displacements + i * stride_bytes, stride_bytes >= 3 sizeof(pal_real). The old content is never read.
 * This function may run on one thread beside the threads of the other calls. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_visual_frame(pal_session* session, pal_real* displacements,
                                                  size_t stride_bytes) PAL_NOEXCEPT;

/* Restricts visual frames to these packed nodes, in this order. `nodes`: [count], strictly ascending. With
 * count 0 frames write all nodes; `nodes` may then be NULL. Thread: the visual frames'. Real-time safe:
 * yes. */
PAL_NODISCARD PAL_API pal_status pal_session_request_nodes(pal_session* session, const uint32_t* nodes,
                                                           uint32_t count) PAL_NOEXCEPT;

/* Writes unit outward normals of the displaced surface; zero for nodes without a triangle. `displacements`:
 * all nodes, as pal_visual_frame writes them. Node i's normal is at (char*)normals + i * normal_stride.
 * Strides are bytes, >= 3 sizeof(pal_real). The buffers must not overlap. Thread: any. Real-time safe:
 * yes. */
PAL_NODISCARD PAL_API pal_status pal_pack_compute_normals(const pal_pack* pack, const pal_real* displacements,
                                                          size_t displacement_stride, pal_real* normals,
                                                          size_t normal_stride) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_FIELD_H */
