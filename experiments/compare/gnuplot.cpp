#include "gnuplot.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

namespace alces::offline {
namespace {

std::string first_error_line(const std::filesystem::path& log) {
  std::ifstream file(log);
  std::string last;
  for (std::string line; std::getline(file, line);)
    if (line.find_first_not_of(" ^\t\r") != std::string::npos) last = line;
  return last.empty() ? "it does not say why" : last;
}

}  // namespace

std::string draw(const std::string& gnuplot, const std::filesystem::path& folder, const std::string& script,
                 PictureFormat format) {
  std::string program = gnuplot;
  std::string option = "-e";
  std::string setting = format == PictureFormat::png ? "format='png'" : "format='svg'";
  std::string file = script;
  const std::array<char*, 5> arguments{program.data(), option.data(), setting.data(), file.data(), nullptr};
  const std::filesystem::path log = std::filesystem::absolute(folder) / (script + ".log");

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  pid_t child = 0;
  const int spawned = posix_spawnp(&child, gnuplot.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  std::error_code ignored;
  if (spawned != 0) {
    std::filesystem::remove(log, ignored);
    return spawned == ENOENT
               ? fmt::format(
                     "{} is not installed (Debian: gnuplot-nox): there are no pictures, but their data "
                     "and scripts are in {}",
                     gnuplot, folder.string())
               : fmt::format("{} cannot be run ({}): there are no pictures", gnuplot,
                             std::generic_category().message(spawned));
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  std::string problem;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    problem =
        fmt::format("{} does not draw {}: {}", gnuplot, (folder / script).string(), first_error_line(log));
  std::filesystem::remove(log, ignored);
  return problem;
}

}  // namespace alces::offline
