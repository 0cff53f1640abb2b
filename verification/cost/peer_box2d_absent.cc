// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/peers.h"

namespace tangible {

std::unique_ptr<Peer> Box2dPeer(const Scene& /*scene*/) { return nullptr; }

}  // namespace tangible
