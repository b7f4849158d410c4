// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace holdfast {

/// An action that can be generated, and its objects. Action names are those of GRAB; objects are
/// names of embedded objects, most common first.
struct ScriptedAction {
  std::string_view name;
  std::vector<std::string_view> objects;
  double share = 1.0;  ///< relative frequency among the clips of a set
};

std::span<const ScriptedAction> ScriptedActions();
/// Throws Error for an unknown name; the message lists all names and suggests the nearest.
const ScriptedAction& FindScriptedAction(std::string_view name);
/// Returns "drink, eat, ..." for help and messages.
std::string ScriptedActionNames();

}  // namespace holdfast
