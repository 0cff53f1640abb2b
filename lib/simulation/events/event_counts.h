// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How many events each pair of bodies, or joint, has had in a step. `max_events_per_step` bounds
// them pair by pair: a thousand balls that land in one step have one event each.

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "tangible/dynamics/elements/contact.h"

namespace tangible {

class EventCounts {
 public:
  void Clear() { counts_.clear(); }
  int num_pairs() const { return static_cast<int>(counts_.size()); }
  int Of(const ActiveContact& contact) const {
    const auto place = std::lower_bound(counts_.begin(), counts_.end(), Entry{KeyOf(contact), 0});
    return place != counts_.end() && place->first == KeyOf(contact) ? place->second : 0;
  }
  /// Counts one more and returns the new number.
  int Add(const ActiveContact& contact) {
    const auto place = std::lower_bound(counts_.begin(), counts_.end(), Entry{KeyOf(contact), 0});
    if (place != counts_.end() && place->first == KeyOf(contact)) {
      return ++place->second;
    }
    counts_.insert(place, {KeyOf(contact), 1});
    return 1;
  }

 private:
  using Key = std::array<int, 3>;
  using Entry = std::pair<Key, int>;
  static Key KeyOf(const ActiveContact& contact) { return {contact.a, contact.b, contact.joint}; }

  std::vector<Entry> counts_;  ///< sorted
};

}  // namespace tangible
