// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Contacts of which only the bodies matter.

#include "tangible/dynamics/elements/contact.h"

namespace tangible::testing {

/// Of bodies a and b, or of the limit of a joint between them.
inline ActiveContact Contact(int a, int b, int joint = -1) {
  ActiveContact contact;
  contact.a = a;
  contact.b = b;
  contact.joint = joint;
  return contact;
}

}  // namespace tangible::testing
