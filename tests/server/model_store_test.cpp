#include "server/model_store.h"

#include <dirent.h>
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/io/model_file.h"
#include "core/io/read_mesh.h"
#include "core/train/train.h"
#include "tests/server/temporary_directory.h"
#include "tests/server/test_part.h"

namespace {

std::atomic<bool> share_hangs = false;

}  // namespace

/// In place of the C library's, for all in this program: they hang as on a share whose file server is away, until that
/// is back.
extern "C" dirent* readdir(DIR* directory) {
  static const auto read_entry = reinterpret_cast<dirent* (*)(DIR*)>(::dlsym(RTLD_NEXT, "readdir"));
  share_hangs.wait(true);
  return read_entry(directory);
}

extern "C" int stat(const char* path, struct stat* info) {
  static const auto look_at = reinterpret_cast<int (*)(const char*, struct stat*)>(::dlsym(RTLD_NEXT, "stat"));
  share_hangs.wait(true);
  return look_at(path, info);
}

namespace binpose::server {
namespace {

using ::testing::HasSubstr;

/// The L-shaped block, trained once; a copy, without the slack that training leaves in its vectors.
const Model& block() {
  static const Model trained = [] {
    TrainParams params;
    params.viewpoint_count = 64;
    return train(read_mesh(l_block_stl(), MeshFormat::kStl, 0.001).value(), params, {}).value();
  }();
  static const Model copy = trained;
  return copy;
}

std::unique_ptr<ModelStore> open_store(const std::filesystem::path& directory) {
  auto store = ModelStore::open(directory);
  EXPECT_TRUE(store.ok()) << store.status();
  return *std::move(store);
}

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

class ModelStoreTest : public ::testing::Test {
 protected:
  const std::filesystem::path& path() const { return directory_.path(); }
  /// Names of all files but hidden ones.
  std::set<std::string> model_files() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path())) {
      const std::string name = entry.path().filename();
      if (!name.starts_with('.')) names.insert(name);
    }
    return names;
  }

 private:
  TemporaryDirectory directory_;
};

TEST_F(ModelStoreTest, GivesBackAfterReopeningWhatWasPut) {
  const auto before = open_store(path())->put("block", block());
  ASSERT_TRUE(before.ok());
  const auto store = open_store(path());
  EXPECT_EQ(store->skipped_files(), 0);
  const auto after = store->find("block");
  ASSERT_TRUE(after.ok());
  EXPECT_EQ((*after)->generation, 1);
  EXPECT_EQ((*after)->create_time, (*before)->create_time);
  EXPECT_EQ((*after)->content_hash, content_hash(block()));
  EXPECT_EQ((*after)->file_bytes, std::filesystem::file_size(path() / "block@1.model"));
  EXPECT_EQ(content_hash((*after)->model), content_hash(block()));
}

TEST_F(ModelStoreTest, MakesTheDirectoryIfItIsMissing) {
  EXPECT_TRUE(open_store(path() / "a" / "b")->put("block", block()).ok());
  EXPECT_TRUE(std::filesystem::exists(path() / "a" / "b" / "block@1.model"));
}

TEST_F(ModelStoreTest, ADirectoryThatCannotBeHadIsAnErrorThatNamesIt) {
  write(path() / "file", "");
  const auto store = ModelStore::open(path() / "file");
  EXPECT_EQ(store.status().code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(store.status().message()), HasSubstr((path() / "file").string()));
}

TEST_F(ModelStoreTest, WhoHoldsAModelKeepsItWhenItIsReplacedOrRemoved) {
  const auto store = open_store(path());
  const auto held = store->put("block", block()).value();
  EXPECT_EQ(store->put("block", block()).value()->generation, 2);
  ASSERT_TRUE(store->remove("block").ok());
  EXPECT_EQ(held->generation, 1);
  EXPECT_EQ(content_hash(held->model), content_hash(block()));
}

TEST_F(ModelStoreTest, ARemovedModelIsGoneForGood) {
  const auto store = open_store(path());
  ASSERT_TRUE(store->put("block", block()).ok());
  ASSERT_TRUE(store->remove("block").ok());
  EXPECT_EQ(store->find("block").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(store->remove("block").code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(open_store(path())->usage().models, 0);
}

TEST_F(ModelStoreTest, ASaveThatFailsSaysWhyAndLeavesTheOldModelServed) {
  const auto store = open_store(path() / "models");
  ASSERT_TRUE(store->put("block", block()).ok());
  std::filesystem::remove_all(path() / "models");
  const auto replaced = store->put("block", block());
  EXPECT_EQ(replaced.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(replaced.status().message()), HasSubstr("models: No such file"));
  EXPECT_EQ(store->find("block").value()->generation, 1);
}

TEST_F(ModelStoreTest, IdsThatLookLikeTemporaryOrModelFilesClashWithNone) {
  const std::vector<std::string> ids = {"x", "x.tmp", "x.model", "x.model.tmp", ".x", "-", "..."};
  {
    const auto store = open_store(path());
    for (const std::string& id : ids) ASSERT_TRUE(store->put(id, block()).ok());
  }
  const auto store = open_store(path());
  EXPECT_EQ(store->usage().models, ids.size());
  for (const std::string& id : ids) EXPECT_TRUE(store->find(id).ok()) << id;
}

TEST_F(ModelStoreTest, SkipsAndCountsWhatIsNoModelAndDeletesNothing) {
  ASSERT_TRUE(open_store(path())->put("good", block()).ok());
  const std::string good = read(path() / "good@1.model");
  write(path() / "torn.model", good.substr(0, good.size() / 2));
  write(path() / "short.model", good.substr(0, 10));
  write(path() / "empty.model", "");
  write(path() / "foreign.model", std::string(1000, 'x'));
  write(path() / "long.model", good + "x");
  write(path() / "bad id.model", good);
  write(path() / "notes.txt", "foreign");
  write(path() / ".good.model.abc123", good.substr(0, 100));  // what a crash leaves behind
  ASSERT_EQ(::mkfifo((path() / "fifo.model").c_str(), 0600), 0);
  std::filesystem::create_directory(path() / "folder.model");
  std::filesystem::create_directory(path() / "lost+found");
  const auto store = open_store(path());
  EXPECT_EQ(store->usage().models, 1);
  EXPECT_TRUE(store->find("good").ok());
  EXPECT_EQ(store->skipped_files(), 9);                                           // all but what is being written
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(path()), {}), 13);  // and the sign
}

TEST_F(ModelStoreTest, RemovesWhatACrashLeftBehindButNoFileThatMayStillBeWritten) {
  const auto old = std::filesystem::file_time_type::clock::now() - std::chrono::hours(1);
  for (const char* name : {".block.model.a1B2c3", ".block.model.Zz9Zz9", ".notes.txt.a1B2c3", ".model"}) {
    write(path() / name, "half");
    std::filesystem::last_write_time(path() / name, old);
  }
  std::filesystem::last_write_time(path() / ".block.model.Zz9Zz9", std::filesystem::file_time_type::clock::now());
  open_store(path());
  EXPECT_FALSE(std::filesystem::exists(path() / ".block.model.a1B2c3"));
  for (const char* name : {".block.model.Zz9Zz9", ".notes.txt.a1B2c3", ".model"}) {
    EXPECT_TRUE(std::filesystem::exists(path() / name)) << name;
  }
}

TEST_F(ModelStoreTest, ABitFlippedAnywhereHidesThatModelAlone) {
  ASSERT_TRUE(open_store(path())->put("good", block()).ok());
  const std::string good = read(path() / "good@1.model");
  constexpr std::size_t kHeader = 160;
  for (std::size_t i = 0; i < good.size(); i += i < kHeader ? 1 : good.size() / 40) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 1);
    write(path() / "bad.model", bad);
    const auto store = open_store(path());
    EXPECT_EQ(store->skipped_files(), 1) << "byte " << i;
    EXPECT_TRUE(store->find("good").ok());
  }
}

TEST_F(ModelStoreTest, AFileCanBeCopiedUnderAnotherId) {
  ASSERT_TRUE(open_store(path())->put("block", block()).ok());
  std::filesystem::copy(path() / "block@1.model", path() / "copy.model");
  EXPECT_EQ(open_store(path())->find("copy").value()->id, "copy");
}

/// Whether `condition` comes true within the time that following the directory may take.
bool soon(const std::function<bool()>& condition) {
  for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return condition();
}

TEST_F(ModelStoreTest, FollowsWhatAnotherServerPutsReplacesAndRemoves) {
  const auto store = open_store(path());
  const auto other = open_store(path());
  ASSERT_TRUE(other->put("block", block()).ok());
  EXPECT_TRUE(soon([&] { return store->find("block").ok(); }));
  ASSERT_TRUE(other->put("block", block()).ok());
  EXPECT_TRUE(soon([&] { return store->find("block").value()->generation == 2; }));
  ASSERT_TRUE(other->remove("block").ok());
  EXPECT_TRUE(soon([&] { return !store->find("block").ok(); }));
}

TEST_F(ModelStoreTest, TwoServersThatTrainTheSameIdCountGenerationsTogether) {
  const auto store = open_store(path());
  const auto other = open_store(path());
  ASSERT_EQ(other->put("block", block()).value()->generation, 1);
  EXPECT_EQ(store->put("block", block()).value()->generation, 2);
  EXPECT_EQ(other->put("block", block()).value()->generation, 3);
}

TEST_F(ModelStoreTest, TrainingsOfOneIdOnThreeServersAtOnceGiveOneGenerationEach) {
  constexpr int kServers = 3;
  constexpr int kTrainings = 20;
  std::vector<std::unique_ptr<ModelStore>> stores;
  for (int i = 0; i < kServers; ++i) {
    stores.push_back(ModelStore::open(path(), {.keep_generations = 1}).value());
  }
  std::vector<std::vector<std::uint32_t>> generations(kServers);
  {
    std::vector<std::jthread> threads;
    for (int s = 0; s < kServers; ++s) {
      threads.emplace_back([&, s] {
        for (int i = 0; i < kTrainings; ++i) {
          generations[s].push_back(stores[s]->put("block", block()).value()->generation);
        }
      });
    }
  }
  std::set<std::uint32_t> all;
  for (const auto& of_server : generations) {
    EXPECT_TRUE(std::is_sorted(of_server.begin(), of_server.end()));
    all.insert(of_server.begin(), of_server.end());
  }
  EXPECT_EQ(all.size(), kServers * kTrainings);
  for (const auto& store : stores) {
    EXPECT_TRUE(soon([&] { return store->find("block").value()->generation == *all.rbegin(); }));
  }
  EXPECT_EQ(model_files(), std::set<std::string>({"block@" + std::to_string(*all.rbegin()) + ".model"}));
}

TEST_F(ModelStoreTest, KeepsTheConfiguredNumberOfGenerations) {
  const auto store = ModelStore::open(path(), {.keep_generations = 3}).value();
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(store->put("block", block()).ok());
  EXPECT_EQ(model_files(), std::set<std::string>({"block@3.model", "block@4.model", "block@5.model"}));
  EXPECT_EQ(open_store(path())->find("block").value()->generation, 5);
}

TEST_F(ModelStoreTest, ADeletedModelStaysAwayThoughAnOlderGenerationComesBackAndCountsOnWhenTrainedAgain) {
  const auto store = open_store(path());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(store->put("block", block()).ok());
  const std::string third = read(path() / "block@3.model");
  ASSERT_TRUE(store->remove("block").ok());
  EXPECT_EQ(model_files(), std::set<std::string>({"block@4.model"}));
  write(path() / "block@3.model", third);  // as if the server had been killed before it removed it
  EXPECT_EQ(open_store(path())->usage().models, 0);
  EXPECT_EQ(store->put("block", block()).value()->generation, 5);
  EXPECT_EQ(open_store(path())->usage().models, 1);
}

TEST_F(ModelStoreTest, ReadsTheFilesOfEarlierReleasesAndCountsTheirGenerationsOn) {
  {
    const auto store = open_store(path());
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(store->put("block", block()).ok());
  }
  std::filesystem::remove(path() / "block@2.model");
  std::filesystem::rename(path() / "block@3.model", path() / "block.model");
  std::filesystem::remove(path() / ".binpose");
  const auto store = open_store(path());
  EXPECT_EQ(store->find("block").value()->generation, 3);
  EXPECT_EQ(store->put("block", block()).value()->generation, 4);
  EXPECT_EQ(store->put("block", block()).value()->generation, 5);
  EXPECT_EQ(model_files(), std::set<std::string>({"block@4.model", "block@5.model"}));
}

TEST_F(ModelStoreTest, ANewestGenerationThatIsTornLeavesTheOneBefore) {
  {
    const auto store = open_store(path());
    for (int i = 0; i < 2; ++i) ASSERT_TRUE(store->put("block", block()).ok());
  }
  write(path() / "block@2.model", read(path() / "block@2.model").substr(0, 1000));
  const auto store = open_store(path());
  EXPECT_EQ(store->find("block").value()->generation, 1);
  EXPECT_EQ(store->skipped_files(), 1);
  EXPECT_EQ(store->put("block", block()).value()->generation, 3);
}

TEST_F(ModelStoreTest, ServesFromMemoryWhileTheDirectoryIsAwayAndCatchesUp) {
  const std::filesystem::path models = path() / "models";
  const auto store = open_store(models);
  ASSERT_TRUE(store->put("block", block()).ok());
  std::filesystem::rename(models, path() / "away");
  std::filesystem::create_directory(models);  // what is under the place where a share was mounted
  EXPECT_TRUE(soon([&] { return store->directory_age() > 1; }));
  EXPECT_TRUE(store->find("block").ok());
  EXPECT_EQ(store->put("block", block()).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(store->remove("block").code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(std::filesystem::is_empty(models));
  ASSERT_TRUE(open_store(path() / "away")->put("block", block()).ok());
  std::filesystem::remove(models);
  std::filesystem::rename(path() / "away", models);
  EXPECT_TRUE(soon([&] { return store->find("block").value()->generation == 2; }));
}

TEST_F(ModelStoreTest, AFileThatIsTornWhileItIsCopiedNeverTakesTheModelsPlace) {
  const auto store = open_store(path());
  ASSERT_TRUE(store->put("block", block()).ok());
  const std::string good = read(path() / "block@1.model");
  write(path() / "block@1.model", good.substr(0, good.size() / 2));
  EXPECT_TRUE(soon([&] { return store->skipped_files() == 1; }));
  EXPECT_TRUE(store->find("block").ok());
}

TEST_F(ModelStoreTest, AModelThatAloneIsOverTheMemoryBudgetIsRefusedAndNotSaved) {
  const auto store = ModelStore::open(path(), {.memory_bytes = memory_bytes(block()) / 2}).value();
  EXPECT_EQ(store->put("block", block()).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_TRUE(model_files().empty());
}

TEST_F(ModelStoreTest, ServesMoreModelsThanFitMemory) {
  const ModelLimits tight = {.memory_bytes = memory_bytes(block()) * 5 / 2, .load_threads = 4};
  const auto store = ModelStore::open(path(), tight).value();
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(store->put("block" + std::to_string(i), block()).ok());
  const auto again = ModelStore::open(path(), tight).value();
  for (ModelStore* each : {store.get(), again.get()}) {
    EXPECT_EQ(each->usage().models, 5);
    EXPECT_LT(each->usage().in_memory, 3);
    EXPECT_LE(each->usage().bytes, tight.memory_bytes);
    for (int i = 0; i < 5; ++i) {
      const auto found = each->find("block" + std::to_string(i));
      ASSERT_TRUE(found.ok()) << found.status();
      EXPECT_EQ((*found)->content_hash, content_hash(block()));
      EXPECT_EQ((*found)->generation, 1);
    }
  }
}

TEST_F(ModelStoreTest, FindsTheNextGenerationOfAModelWhoseFileWasPrunedSinceItLeftMemory) {
  const auto store = ModelStore::open(path(), {.memory_bytes = memory_bytes(block()) * 3 / 2}).value();
  ASSERT_TRUE(store->put("block", block()).ok());
  ASSERT_TRUE(store->put("other", block()).ok());
  std::filesystem::rename(path() / "block@1.model", path() / "block@2.model");  // before the next look
  const auto found = store->find("block");
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ((*found)->generation, 2);
}

TEST_F(ModelStoreTest, SaysThatAModelIsOutOfReachWhileTheDirectoryIsAwayAndItIsNotInMemory) {
  const std::filesystem::path models = path() / "models";
  const auto store = ModelStore::open(models, {.memory_bytes = memory_bytes(block()) * 3 / 2}).value();
  ASSERT_TRUE(store->put("block", block()).ok());
  ASSERT_TRUE(store->put("other", block()).ok());
  std::filesystem::rename(models, path() / "away");
  EXPECT_EQ(store->find("block").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(store->find("other").ok());
  EXPECT_TRUE(store->describe("block").ok());
  std::filesystem::rename(path() / "away", models);
  EXPECT_TRUE(store->find("block").ok());
}

TEST_F(ModelStoreTest, KeepsNoCallerWhileTheDirectoryHangs) {
  const auto store = ModelStore::open(path(), {.memory_bytes = memory_bytes(block()) * 3 / 2}).value();
  ASSERT_TRUE(store->put("block", block()).ok());
  ASSERT_TRUE(store->put("other", block()).ok());
  share_hangs = true;
  EXPECT_EQ(store->put("new", block()).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(store->remove("other").code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(store->find("block").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(store->find("other").ok());
  share_hangs = false;
  share_hangs.notify_all();
  while (store->directory_age() > 1) std::this_thread::yield();
  EXPECT_TRUE(store->find("block").ok());
  EXPECT_TRUE(store->put("block", block()).ok());
}

TEST_F(ModelStoreTest, LoadsOnSeveralThreadsWhatOneThreadLoads) {
  {
    const auto store = open_store(path());
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(store->put("block" + std::to_string(i), block()).ok());
  }
  EXPECT_EQ(ModelStore::open(path(), {.load_threads = 4}).value()->usage().models, 20);
}

TEST(CheckModelId, TakesWhatTheRuleAllowsAndNothingElse) {
  for (const std::string& id : {std::string("a"), std::string("A-z_0.9"), std::string(64, 'x'), std::string("...")}) {
    EXPECT_TRUE(check_model_id("id", id).ok()) << id;
  }
  for (const std::string& id :
       {std::string(), std::string("."), std::string(".."), std::string(65, 'x'), std::string("a/b"),
        std::string("a b"), std::string("\xc3\xa4"), std::string(1, '\0')}) {
    EXPECT_EQ(check_model_id("id", id).code(), absl::StatusCode::kInvalidArgument) << id;
  }
}

}  // namespace
}  // namespace binpose::server
