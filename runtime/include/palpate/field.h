/* The picture: displacements and normals of the nodes that the scene shows. */
#ifndef PALPATE_FIELD_H
#define PALPATE_FIELD_H

#include <palpate/session.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The numbers of displacement fields; all other numbers are double. A library built with PALPATE_FLOAT64=1 has double
 * here, opens packs of such builders alone, and needs the same definition in its callers. */
#if defined(PALPATE_FLOAT64) && PALPATE_FLOAT64
typedef double pal_real;
/* A caller without the definition then does not link. */
#define pal_visual_frame pal_visual_frame_float64
#define pal_pack_compute_normals pal_pack_compute_normals_float64
#else
typedef float pal_real;
#endif

/* Displacements of all packed nodes from pal_geometry::positions, gravity's included, organ frame, m, under the contacts
 * of the last frame that has returned. Node i's three numbers are written at (char*)displacements + i * stride_bytes,
 * stride_bytes >= 3 sizeof(pal_real). The memory is never read. One thread beside those of the other calls may call this.
 * Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_visual_frame(pal_session* session, pal_real* displacements,
                                                  size_t stride_bytes) PAL_NOEXCEPT;

/* Lets visual frames write these packed nodes alone, one after another. `nodes`: [count], strictly ascending. Count 0:
 * all nodes again; `nodes` may then be NULL. On the thread of the visual frames. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_session_request_nodes(pal_session* session, const uint32_t* nodes,
                                                           uint32_t count) PAL_NOEXCEPT;

/* Unit normals of the displaced surface, out of the tissue; zero for nodes without a triangle. `displacements`: of all
 * packed nodes, as pal_visual_frame writes them. Node i's three numbers are at (char*)normals + i * normal_stride. Both
 * strides: bytes, >= 3 sizeof(pal_real). The buffers must not overlap. Any thread. Real-time safe: yes. */
PAL_NODISCARD PAL_API pal_status pal_pack_compute_normals(const pal_pack* pack, const pal_real* displacements,
                                                          size_t displacement_stride, pal_real* normals,
                                                          size_t normal_stride) PAL_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PALPATE_FIELD_H */
