// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <vector>

#include "geometry/clip.h"
#include "geometry/contact_metrics.h"
#include "geometry/hand_model.h"
#include "geometry/signed_distance.h"

namespace holdfast {

/// Contact of one hand with the object in every frame of a clip, intersection volume included.
/// `object` is the full-resolution mesh in its own frame. Frames are shared among
/// `protocol.threads`; the result does not depend on it. `progress` (frames done, frames) may be
/// empty, is called from any thread one at a time, and stops the measurement by returning false.
/// Throws Error for a clip without an object.
std::vector<ContactMetrics> MeasureClipContact(const Clip& clip, const HandModel& hand,
                                               const SignedDistance& object,
                                               const ContactProtocol& protocol,
                                               const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
