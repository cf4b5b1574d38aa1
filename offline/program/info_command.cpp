#include "command.h"
namespace alces::offline {
void add_info_command(CLI::App&) {}
}  // namespace alces::offline
