// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include "generator/matching/sole_contact.h"

namespace holdfast {

/// Contacts of a motion whose feet may slide, as networks make them: in every frame one foot at
/// least carries, the one that is low and slow for longest, however fast it slides. Which feet
/// carry is the cheapest way through {left, right, both} over all frames: a stance foot costs
/// by its height and speed, one that does not by being low and still, a change of feet by itself.
/// The points on the ground of a stance foot are FindContacts's, or else its lowest.
std::vector<SoleBits> FindSupports(std::span<const Soles> soles, double frame_rate);

}  // namespace holdfast
