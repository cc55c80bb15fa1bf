// Zhong et al. 2005 figure 6: a probe that was prepared for S touches at T instead. (a) PFE has one tensor, that of S, and
// bends S; (b) EPFE takes the blocks of T from the inverse stiffness; (c) eq. (25) moves the tensor of S to T, in the sense that its
// construction asks for.
#include "bench/peers/elsewhere_picture.hpp"
#include "bench/peers/peers.hpp"
#include "bench/peers/site_sets.hpp"
#include "offline/cli/fixed_tensor.hpp"
