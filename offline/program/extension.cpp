#include "extension.h"

namespace alces::offline {
namespace {

std::vector<Extension>& added_extensions() {
  static std::vector<Extension> added;
  return added;
}

}  // namespace

void add_extension(Extension extension) {
  added_extensions().push_back(extension);
}

const std::vector<Extension>& extensions() {
  return added_extensions();
}

}  // namespace alces::offline
