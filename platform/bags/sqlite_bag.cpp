#include "bag_files.h"

#ifdef ALCES_HAS_SQLITE
#include <sqlite3.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "zstd_source.h"

namespace alces::bags {
namespace {

namespace fs = std::filesystem;

/// A database that others wrote may be made to harm: nothing in it runs, nothing is written, and rows are no
/// longer than a message.
class Database {
 public:
  explicit Database(const fs::path& file) {
    // Immutable only where it is needed: it would leave out what a recording that was not closed keeps in the
    // file beside.
    if (open("file:" + escaped(file) + "?mode=ro") && can_read()) return;
    close();
    if (!open("file:" + escaped(file) + "?immutable=1"))
      throw BagError(file, std::string("cannot be opened by SQLite (") + sqlite3_errmsg(database_) + ")");
    is_immutable_ = true;
  }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  ~Database() { close(); }

  [[nodiscard]] sqlite3* get() const { return database_; }
  [[nodiscard]] bool is_immutable() const { return is_immutable_; }
  [[nodiscard]] std::string error() const { return sqlite3_errmsg(database_); }

 private:
  static std::string escaped(const fs::path& file) {
    std::string uri;
    for (const char c : fs::absolute(file).string()) {
      if (c == '?' || c == '#' || c == '%') {
        constexpr std::string_view digits = "0123456789ABCDEF";
        const auto byte = static_cast<unsigned char>(c);
        uri += {'%', digits[byte / 16], digits[byte % 16]};
      } else {
        uri += c;
      }
    }
    return uri;
  }

  bool open(const std::string& uri) {
    const int flags = SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX;
    if (sqlite3_open_v2(uri.c_str(), &database_, flags, nullptr) != SQLITE_OK) return false;
    sqlite3_db_config(database_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(database_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_limit(database_, SQLITE_LIMIT_LENGTH, static_cast<int>(BagReader::largest_message_bytes));
    sqlite3_busy_timeout(database_, 2000);
    sqlite3_exec(database_, "PRAGMA cell_size_check=ON", nullptr, nullptr, nullptr);
    return true;
  }
  [[nodiscard]] bool can_read() const {
    return sqlite3_exec(database_, "SELECT 1 FROM sqlite_master LIMIT 1", nullptr, nullptr, nullptr) ==
           SQLITE_OK;
  }
  void close() {
    sqlite3_close(database_);
    database_ = nullptr;
  }

  sqlite3* database_ = nullptr;
  bool is_immutable_ = false;
};

class Statement {
 public:
  Statement(const Database& database, const std::string& sql) {
    result_ = sqlite3_prepare_v2(database.get(), sql.c_str(), -1, &statement_, nullptr);
  }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement() { sqlite3_finalize(statement_); }

  /// False: no more rows, or an error: result().
  bool step() {
    if (statement_ == nullptr) return false;
    result_ = sqlite3_step(statement_);
    return result_ == SQLITE_ROW;
  }
  [[nodiscard]] bool failed() const {
    return result_ != SQLITE_OK && result_ != SQLITE_ROW && result_ != SQLITE_DONE;
  }
  [[nodiscard]] std::string text(int column) const {
    const auto* bytes = sqlite3_column_text(statement_, column);
    if (bytes == nullptr) return {};
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
    return {reinterpret_cast<const char*>(bytes), size};
  }
  [[nodiscard]] std::int64_t number(int column) const { return sqlite3_column_int64(statement_, column); }
  [[nodiscard]] std::span<const std::uint8_t> blob(int column) const {
    const void* bytes = sqlite3_column_blob(statement_, column);
    const int size = sqlite3_column_bytes(statement_, column);
    if (bytes == nullptr || size <= 0) return {};
    return {static_cast<const std::uint8_t*>(bytes), static_cast<std::size_t>(size)};
  }

 private:
  sqlite3_stmt* statement_ = nullptr;
  int result_ = SQLITE_OK;
};

class SqliteBag final : public BagReader {
 public:
  SqliteBag(const fs::path& file, const Topics& topics)
      : file_(file), total_bytes_(size_of(file)), database_(file) {
    require_tables();
    if (database_.is_immutable())
      problem(file_, "was not closed when it was recorded; what SQLite keeps beside it is not read");
    read_topics();
    read_definitions();
    std::string chosen;
    for (const auto& [id, place] : places_) {
      if (!is_asked_for(topics, channels_[place].topic)) continue;
      if (!chosen.empty()) chosen.push_back(',');
      chosen += std::to_string(id);
    }
    std::string where;
    if (!topics.empty()) where.append(" WHERE topic_id IN (").append(chosen).append(")");
    // Without an index SQLite would sort the whole file beside it: then they come as they were written.
    const std::string order = has("index", "timestamp_idx") ? " ORDER BY timestamp" : " ORDER BY id";
    std::string sql = "SELECT topic_id, timestamp, data FROM messages";
    messages_.emplace(database_, sql.append(where).append(order));
    count_rows();
  }

  bool next(Message& message) override {
    while (messages_->step()) {
      ++rows_read_;
      const auto place = places_.find(messages_->number(0));
      if (place == places_.end()) {
        if (rows_without_topic_++ == 0)
          problem(file_, "has messages whose topic is not in its table of topics");
        continue;
      }
      const auto time_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(messages_->number(1), 0));
      message = {place->second, sane_ns(time_ns), messages_->blob(2)};
      return true;
    }
    if (messages_->failed() && !is_told_)
      problem(file_, "is damaged (SQLite: " + database_.error() +
                         "); what could be read before is there, 'sqlite3 FILE .recover' may find more");
    is_told_ = true;
    return false;
  }

  [[nodiscard]] const std::vector<Channel>& channels() const override { return channels_; }
  [[nodiscard]] std::string title() const override { return "rosbag2 (SQLite)"; }
  [[nodiscard]] std::uint64_t bytes_read() const override {
    if (rows_ == 0) return total_bytes_;
    const double part = static_cast<double>(std::min(rows_read_, rows_)) / static_cast<double>(rows_);
    return static_cast<std::uint64_t>(part * static_cast<double>(total_bytes_));
  }
  [[nodiscard]] std::uint64_t total_bytes() const override { return total_bytes_; }

 private:
  [[nodiscard]] bool has(const std::string& kind, const std::string& name) const {
    // A view or a virtual table would run what somebody else wrote.
    std::string sql = "SELECT sql FROM sqlite_master WHERE type = '";
    sql.append(kind)
        .append("' AND name = '")
        .append(name)
        .append("' AND sql LIKE 'CREATE ")
        .append(kind)
        .append("%'");
    Statement statement(database_, sql);
    return statement.step();
  }

  void require_tables() const {
    Statement probe(database_, "SELECT name FROM sqlite_master LIMIT 1");
    probe.step();
    if (probe.failed())
      throw BagError(file_, "cannot be read by SQLite (" + database_.error() + "); is it a whole .db3 file?");
    if (!has("table", "topics") || !has("table", "messages"))
      throw BagError(file_, "is a database, and no bag of ROS 2: it has no tables 'topics' and 'messages'");
  }

  void read_topics() {
    Statement topics(database_, "SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    constexpr std::size_t most_topics = 65'536;
    while (channels_.size() < most_topics && topics.step()) {
      places_.emplace(topics.number(0), channels_.size());
      const std::string encoding = topics.text(3);
      channels_.push_back(
          {topics.text(1), plain_type(topics.text(2)), encoding_called(encoding), encoding, {}});
    }
    if (topics.failed())
      throw BagError(file_, "its table of topics is damaged (SQLite: " + database_.error() +
                                "); 'sqlite3 FILE .recover' may mend it");
  }

  /// Since ROS 2 Iron the bag brings them.
  void read_definitions() {
    if (!has("table", "message_definitions")) return;
    Statement definitions(
        database_,
        "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'");
    while (definitions.step()) {
      const std::string type = plain_type(definitions.text(0));
      for (Channel& channel : channels_) {
        if (channel.type == type) channel.definition = definitions.text(1);
      }
    }
  }

  /// The largest row number is near enough for a progress bar, and costs nothing.
  void count_rows() {
    Statement largest(database_, "SELECT max(id) FROM messages");
    if (largest.step()) rows_ = static_cast<std::uint64_t>(std::max<std::int64_t>(largest.number(0), 0));
  }

  fs::path file_;
  std::uint64_t total_bytes_;
  Database database_;
  std::map<std::int64_t, std::size_t> places_;
  std::vector<Channel> channels_;
  std::optional<Statement> messages_;
  std::uint64_t rows_ = 0;
  std::uint64_t rows_read_ = 0;
  std::uint64_t rows_without_topic_ = 0;
  bool is_told_ = false;
};

}  // namespace

std::unique_ptr<BagReader> open_sqlite_bag(const fs::path& file, const Topics& topics) {
  return std::make_unique<SqliteBag>(file, topics);
}

}  // namespace alces::bags

#else

namespace alces::bags {

std::unique_ptr<BagReader> open_sqlite_bag(const std::filesystem::path& file, const Topics& /*topics*/) {
  throw BagError(file, "this alces was built without SQLite; 'ros2 bag convert' makes MCAP of it");
}

}  // namespace alces::bags

#endif
