#include "alces_drivers/scanner/laser.h"

namespace alces {

const char* to_string(LaserState state) {
  switch (state) {
    case LaserState::stopped:
      return "stopped";
    case LaserState::connecting:
      return "connecting";
    case LaserState::configuring:
      return "configuring";
    case LaserState::measuring:
      return "measuring";
    case LaserState::stopping:
      return "stopping";
    case LaserState::failed:
      return "failed";
  }
  return "unknown";
}

}  // namespace alces
