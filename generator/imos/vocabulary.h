// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace holdfast::imos {

inline constexpr int kNumActions = 29;
inline constexpr int kNumObjects = 54;

/// An action of the GRAB recordings, numbered as in IMoS (Ghosh et al. 2023).
struct Action {
  std::string_view label;  ///< "takepicture"
  std::string_view verb;   ///< as used in the sentence: "takes picture with"
};

/// All actions and objects. The index of a name is its id in one-hot vectors and tables.
std::span<const Action, kNumActions> Actions();
std::span<const std::string_view, kNumObjects> Objects();

/// Ids by name. Case, spaces, '-' and '_' are ignored ("Switch on", "wine glass"). Objects may be
/// given by any of the names below. Everyday names of actions are known too ("phone": call, "brush
/// teeth": brush, "photograph": takepicture, "hand over": pass).
std::optional<int> FindAction(std::string_view name);
std::optional<int> FindObject(std::string_view name);
/// Same, but throws Error (`where` names the option or field) for an unknown name, with the nearest
/// name by edit distance and the whole list; for actions, the list is `offered` unless it is empty.
int ActionId(std::string_view name, std::string_view where = "action",
             std::span<const std::string_view> offered = {});
int ObjectId(std::string_view name, std::string_view where = "object");

/// Returns the name of the object's embedded mesh, and the inverse. bottle is waterbottle in the
/// vocabulary; cube, cylinder and sphere are the medium ones; all others have the same name. Does
/// not check whether an embedded mesh of that name exists.
std::string_view EmbeddedMeshName(std::string_view vocabulary_name);
std::string_view VocabularyName(std::string_view embedded_mesh_name);

struct Intent {
  int action = 0;
  int object = 0;
};

/// "The person drinks from the mug."
std::string SentenceOf(const Intent& intent);

struct ParsedSentence : Intent {
  std::string because;  ///< the words that gave the action, if its name is not in the sentence
};

/// Finds the action and the object in a sentence: "The person drinks from the mug", "he is pouring
/// out of a small sphere", "drink mug". Verbs may end in -s or -ing. Of several matches the longest
/// counts, then the first for the action and the last for the object. Other words count where no
/// action is named, or only one that is a part of others (lift, use, inspect, pass): "raise the cup
/// and take a sip" is drink. `known` replaces what the sentence says, if set. Throws Error if
/// either is missing, with the known name nearest to any of the words, and lists the `offered`
/// actions and objects (all if empty).
ParsedSentence ParseSentence(std::string_view sentence,
                             std::span<const std::string_view> offered_actions = {},
                             std::span<const std::string_view> offered_objects = {},
                             std::optional<int> known_action = {},
                             std::optional<int> known_object = {});

/// Returns the `offered` action that looks most like another one; nothing if none does.
std::optional<int> SimilarAction(int action, std::span<const std::string> offered);

}  // namespace holdfast::imos
