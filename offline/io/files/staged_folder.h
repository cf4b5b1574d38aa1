// A folder whose files appear together: written beside it, synced, and put into its place by one exchange, so
// that whoever looks, and whatever fails or is killed, finds the old folder whole or the new one.
//
// | what is at FOLDER | what happens |
// |---|---|
// | nothing | the new folder gets the name |
// | a folder | both change places at once (renameat2, RENAME_EXCHANGE); the old one is removed |
// | ... on a file system without exchange | the old one is renamed, then the new one; a run that is killed
// between |     these two is finished by the next | | a link to a folder | the folder that it leads to is
// exchanged, the link stays | | a mount point, the working folder or one above it, a folder with a mount
// point in it, one whose parent |     may not be written | file by file, run.json first away and last back: a
// mix has no run.json |
//
// Files of others in FOLDER stay: they get a second name in the new folder before the exchange. A device that
// FOLDER has under the name of one of the files is written to.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "output_file.h"

namespace alces::offline {

class StagedFolder {
 public:
  /// Whether a name at the top of the folder is one that the writer uses: such files of an earlier run go
  /// away.
  using IsOurs = std::function<bool(std::string_view name)>;

  /// Finds out whether the folder can be written and cleans up after a run that was killed. OutputError, also
  /// while another process writes the same folder.
  explicit StagedFolder(const std::filesystem::path& folder, IsOurs is_ours = is_of_map);
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;
  /// Without commit() nothing has happened.
  ~StagedFolder();

  /// Where to write; on the folder's file system.
  [[nodiscard]] const std::filesystem::path& staging() const { return staging_; }
  /// As the user calls it.
  [[nodiscard]] const std::filesystem::path& folder() const { return shown_; }
  /// A sentence about a file in staging(), about that in folder().
  [[nodiscard]] std::string renamed(std::string sentence) const;
  /// OutputError; the old folder is then as it was, except file by file (see above).
  void commit();

  /// The files of a map folder.
  [[nodiscard]] static bool is_of_map(std::string_view name);

 private:
  void choose_staging();
  void recover();
  void lock();
  void keep_devices() const;
  [[nodiscard]] std::vector<std::filesystem::path> carry_foreign();
  [[nodiscard]] bool exchange();
  void replace_file_by_file();
  void sync(const std::filesystem::path& folder) const;
  [[noreturn]] void fail(const std::string& what, int error_number) const;

  std::filesystem::path shown_;
  std::filesystem::path folder_;  ///< absolute, no link
  std::filesystem::path staging_;
  std::optional<SyncedTogether> synced_together_;  ///< what lies in staging_, by commit()
  std::filesystem::path aside_;                    ///< the old one, between two renames
  IsOurs is_ours_;
  int lock_ = -1;
  bool is_inside_ = false;  ///< staging_ is a folder of folder_: file by file
  bool is_committed_ = false;
};

}  // namespace alces::offline
