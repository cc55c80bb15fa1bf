#include <palpate/palpate.h>

extern "C" uint32_t pal_version() noexcept {
  return PAL_VERSION;
}

extern "C" const char* pal_status_text(pal_status status) noexcept {
  switch (status) {
    case PAL_STATUS_OK:
      return "no error";
    case PAL_STATUS_NULL_ARGUMENT:
      return "a pointer that must not be NULL is NULL";
    case PAL_STATUS_BAD_STRUCT_SIZE:
      return "struct_size is not set, or a member unknown to the library is not 0";
    case PAL_STATUS_BAD_ARGUMENT:
      return "an argument is outside its documented range";
    case PAL_STATUS_NOT_FINITE:
      return "an input is not a finite number";
    case PAL_STATUS_NO_SUCH_SITE:
      return "the pack has no such contact site";
    case PAL_STATUS_NO_SUCH_NODE:
      return "the pack has no such contact node";
    case PAL_STATUS_NO_SUCH_MODEL:
      return "the pack or the session lacks the model, tree, gravity or turning patches that the call needs";
    case PAL_STATUS_MODEL_CANNOT_ANSWER:
      return "no model of the session can answer this call";
    case PAL_STATUS_NO_SUCH_TOOL:
      return "the session has no such tool";
    case PAL_STATUS_ALREADY_USED:
      return "a recording must start before the session's first call";
    case PAL_STATUS_ARENA_TOO_SMALL:
      return "the given memory is smaller than required";
    case PAL_STATUS_ARENA_MISALIGNED:
      return "the given memory is not aligned as required";
    case PAL_STATUS_CAPACITY_EXCEEDED:
      return "a count exceeds its capacity: contacts, fixed or requested nodes, or bytes of a recording";
    case PAL_STATUS_FILE_NOT_FOUND:
      return "the file does not exist";
    case PAL_STATUS_FILE_NOT_READABLE:
      return "the file cannot be read";
    case PAL_STATUS_NOT_A_PACK:
      return "the file is not a Palpate pack";
    case PAL_STATUS_WRONG_VERSION:
      return "the pack has another format version; build the pack again with this version";
    case PAL_STATUS_TRUNCATED:
      return "the pack is too short or too long; build or copy the pack again";
    case PAL_STATUS_CORRUPT_TABLES:
      return "the tables of the pack are corrupt; build or copy the pack again";
    case PAL_STATUS_CORRUPT_CONTENT:
      return "the content of the pack contradicts itself; build the pack again";
    case PAL_STATUS_BAD_CHECKSUM:
      return "the checksum of the pack is wrong; build or copy the pack again";
    case PAL_STATUS_OTHER_PRECISION:
      return "the pack and this library differ in PALPATE_FLOAT64; build the pack or the library again";
    case PAL_STATUS_NOT_A_RECORDING:
      return "the data are not a Palpate recording";
    case PAL_STATUS_CORRUPT_RECORDING:
      return "the recording is cut short or corrupt";
    case PAL_STATUS_NOT_RECORDING:
      return "the session has no recording";
    case PAL_STATUS_RECORDING_OF_OTHER_BUILD:
      return "another build of this library made the recording";
    case PAL_STATUS_RECORDING_OF_OTHER_PACK:
      return "the recording belongs to another pack";
  }
  return "unknown status";
}

extern "C" const char* pal_flag_text(uint32_t flag) noexcept {
  switch (flag) {
    case PAL_FLAG_EXTRAPOLATED:
      return "the displacement or the load exceeds the sampled range";
    case PAL_FLAG_CLAMPED:
      return "the displacement or the rotation was shortened to the range of the model";
    case PAL_FLAG_LINEAR_FALLBACK:
      return "no nonlinear model of the pack can answer these contacts; linear_dd answered";
    case PAL_FLAG_OVERLAPPING:
      return "two contacts hold the same node, which follows their mean";
    case PAL_FLAG_ILL_CONDITIONED:
      return "contacts are too close to each other, or given forces cannot all act";
    case PAL_FLAG_BAD_INPUT:
      return "the tool's pose, age or dt is invalid; the last valid value is used";
    case PAL_FLAG_STALE:
      return "the tool's input is too old, or new again; the force ramps";
    case PAL_FLAG_LIMITED:
      return "force and torque were cut to a limit of the session";
    case PAL_FLAG_BLENDING:
      return "contacts or models have changed; the force blends to its new value";
    case PAL_FLAG_NO_ROOM:
      return "the tool touches the surface, but no further contact can be held or answered";
    case PAL_FLAG_PREPARING:
      return "a model for new contacts is in preparation; the former contacts go on, and linear_dd answers "
             "the others";
    case PAL_FLAG_NOT_FINITE:
      return "the model gave no finite force";
    case PAL_FLAG_REDUCED:
      return "the force was reduced so that the tools gain no energy";
    case PAL_FLAG_NEAREST_SITE:
      return "a contact between sites was answered at the site of its largest weight, or as if it were alone";
    case PAL_FLAG_UNCONVERGED:
      return "nonlinear_zone has not converged to a stable equilibrium at this displacement";
    case PAL_FLAG_HELD:
      return "the model's force is unreliable; the last good force plays and fades out";
    case PAL_FLAG_UNREFINED:
      return "no iteration of the refining lane has ended yet for these contacts";
  }
  return "not a known flag";
}
