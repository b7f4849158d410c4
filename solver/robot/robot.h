// SPDX-License-Identifier: MIT
#pragma once

/// Robot hands: converts a clip of a human hand with an object, and a robot's URDF or MJCF, to the
/// robot's wrist and joint motion that preserves the contacts.

#include "geometry/robot/robot_hand.h"
#include "solver/robot/robot_measures.h"
#include "solver/robot/robot_output.h"
#include "solver/robot/transfer_to_robot.h"
