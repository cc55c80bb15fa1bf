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
      return "struct_size is not set to the size of the struct";
    case PAL_STATUS_BAD_ARGUMENT:
      return "an argument is outside its documented range";
    case PAL_STATUS_NOT_FINITE:
      return "an input is not a finite number";
    case PAL_STATUS_NO_SUCH_SITE:
      return "the pack has no such contact site";
    case PAL_STATUS_NO_SUCH_NODE:
      return "the pack has no such contact node";
    case PAL_STATUS_NO_SUCH_MODEL:
      return "the pack does not carry this response model";
    case PAL_STATUS_MODEL_CANNOT_ANSWER:
      return "several contacts, fixed nodes or given forces need linear_dd or zones, which this pack or "
             "session does not use";
    case PAL_STATUS_NO_SUCH_TOOL:
      return "the session has no such tool";
    case PAL_STATUS_ALREADY_USED:
      return "a recording must start before anything else happens to the session";
    case PAL_STATUS_ARENA_TOO_SMALL:
      return "the memory given is smaller than required";
    case PAL_STATUS_ARENA_MISALIGNED:
      return "the memory given is not aligned as required";
    case PAL_STATUS_CAPACITY_EXCEEDED:
      return "more than there is room for: contacts, fixed or requested nodes, or bytes of a recording";
    case PAL_STATUS_FILE_NOT_FOUND:
      return "the file does not exist";
    case PAL_STATUS_FILE_NOT_READABLE:
      return "the file cannot be read";
    case PAL_STATUS_NOT_A_PACK:
      return "this is not a Palpate pack";
    case PAL_STATUS_WRONG_VERSION:
      return "the pack has another format version; build it again with this version";
    case PAL_STATUS_TRUNCATED:
      return "the pack is cut short or has bytes added; build or copy it again";
    case PAL_STATUS_CORRUPT_TABLES:
      return "the tables of the pack are corrupt; build or copy it again";
    case PAL_STATUS_CORRUPT_CONTENT:
      return "the content of the pack contradicts itself; build it again";
    case PAL_STATUS_BAD_CHECKSUM:
      return "the checksum of the pack is wrong; build or copy it again";
    case PAL_STATUS_OTHER_PRECISION:
      return "the pack and this library differ in PALPATE_FLOAT64; build one of them again";
    case PAL_STATUS_NOT_A_RECORDING:
      return "this is not a Palpate recording";
    case PAL_STATUS_CORRUPT_RECORDING:
      return "the recording is cut short or corrupt";
    case PAL_STATUS_NOT_RECORDING:
      return "nothing is being recorded";
    case PAL_STATUS_RECORDING_OF_OTHER_BUILD:
      return "the recording was made with another version of this library";
    case PAL_STATUS_RECORDING_OF_OTHER_PACK:
      return "the recording was made with another pack";
  }
  return "unknown status";
}

extern "C" const char* pal_flag_text(uint32_t flag) noexcept {
  switch (flag) {
    case PAL_FLAG_EXTRAPOLATED:
      return "the displacement or the load is beyond the range that was sampled";
    case PAL_FLAG_CLAMPED:
      return "the displacement or the turn was shortened to the range that the model can answer";
    case PAL_FLAG_LINEAR_FALLBACK:
      return "no nonlinear model of the pack can answer these contacts; linear_dd answered";
    case PAL_FLAG_OVERLAPPING:
      return "two contacts hold the same node, which follows their mean";
    case PAL_FLAG_ILL_CONDITIONED:
      return "contacts are too close to each other, or given forces cannot all act";
    case PAL_FLAG_BAD_INPUT:
      return "the tool's pose, its age or dt made no sense; the last good value was used";
    case PAL_FLAG_STALE:
      return "the tool's input is too old, or has just come back; the force ramps";
    case PAL_FLAG_LIMITED:
      return "force and torque were cut to a limit of the session";
    case PAL_FLAG_BLENDING:
      return "contacts or models have changed, and the jump of the force is being faded out";
    case PAL_FLAG_NO_ROOM:
      return "the tool touched, and the session has no room for a further contact";
    case PAL_FLAG_PREPARING:
      return "the model for new contacts is being prepared; the contacts of before answer";
    case PAL_FLAG_NOT_FINITE:
      return "the model gave no finite force";
    case PAL_FLAG_REDUCED:
      return "the force was reduced so that the tools gain no energy";
    case PAL_FLAG_NEAREST_SITE:
      return "a contact between sites was answered at its nearest site, or as if it were alone";
    case PAL_FLAG_UNCONVERGED:
      return "nonlinear_zone has not converged at this displacement";
    case PAL_FLAG_HELD:
      return "the model's force may have any value; the last good force is played and fades out";
  }
  return "not one known flag";
}
