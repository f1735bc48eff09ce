#include "server/model_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <string>
#include <thread>
#include <vector>

namespace binpose::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A model that takes `kBytes` and a little.
constexpr std::size_t kBytes = std::size_t{1} << 20;
constexpr std::size_t kRoom = kBytes + kBytes / 4;

StoredModel model_of(const std::string& id, std::uint32_t generation = 1) {
  StoredModel stored;
  stored.id = id;
  stored.generation = generation;
  stored.model.surface.resize(kBytes / sizeof(SurfacePoint));
  return stored;
}

std::shared_ptr<const StoredModel> shared_model(const std::string& id, std::uint32_t generation = 1) {
  return std::make_shared<const StoredModel>(model_of(id, generation));
}

absl::StatusOr<StoredModel> load(const std::filesystem::path& /*file*/, const std::string& id) { return model_of(id); }

TEST(ModelCache, LetsThoseGoThatWereNotAskedForLongestAndLoadsThemWhenTheyAre) {
  std::vector<std::string> files;
  ModelCache cache(2 * kRoom, [&](const std::filesystem::path& file, const std::string& id) {
    files.push_back(file);
    return load(file, id);
  });
  cache.put(shared_model("a"), "file of a");
  cache.put(shared_model("b"), "file of b");
  ASSERT_TRUE(cache.find("a").ok());
  cache.put(shared_model("c"), "file of c");  // b leaves
  EXPECT_EQ(cache.usage().models, 3);
  EXPECT_EQ(cache.usage().in_memory, 2);
  EXPECT_LE(cache.usage().bytes, 2 * kRoom);
  EXPECT_TRUE(cache.find("a").ok());
  EXPECT_TRUE(files.empty());
  EXPECT_EQ((*cache.find("b"))->id, "b");  // c leaves
  EXPECT_TRUE(cache.find("a").ok());
  EXPECT_THAT(files, ElementsAre("file of b"));
  EXPECT_TRUE(cache.find("c").ok());
  EXPECT_THAT(files, ElementsAre("file of b", "file of c"));
  EXPECT_EQ(cache.usage().loads, 2);
}

TEST(ModelCache, DescribesAllModelsWhetherOrNotTheyAreInMemory) {
  ModelCache cache(kRoom, load);
  cache.put(shared_model("a", 3), "a");
  cache.put(shared_model("b", 5), "b");
  ASSERT_EQ(cache.usage().in_memory, 1);
  const std::vector<v1::Model> models = cache.list();
  ASSERT_EQ(models.size(), 2);
  EXPECT_EQ(models[0].generation(), 3);
  EXPECT_EQ(models[1].generation(), 5);
  EXPECT_EQ(cache.describe("a")->id(), "a");
  EXPECT_EQ(cache.describe("c").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(cache.usage().loads, 0);
}

TEST(ModelCache, ReadsAFileOnceForAllWhoAskAtAMoment) {
  constexpr int kCallers = 8;
  std::latch asked(kCallers - 1);
  std::atomic<int> reads = 0;
  ModelCache cache(kRoom, [&](const std::filesystem::path& file, const std::string& id) {
    ++reads;
    asked.wait();  // until the others are about to ask, too
    return load(file, id);
  });
  cache.put(shared_model("a"), "a");
  cache.put(shared_model("b"), "b");
  std::atomic<int> found = 0;
  std::vector<std::jthread> callers;
  callers.emplace_back([&] { found += cache.find("a").ok() ? 1 : 0; });
  while (reads == 0) std::this_thread::yield();
  for (int i = 1; i < kCallers; ++i) {
    callers.emplace_back([&] {
      asked.count_down();
      found += cache.find("a").ok() ? 1 : 0;
    });
  }
  callers.clear();
  EXPECT_EQ(found, kCallers);
  EXPECT_EQ(reads, 1);
}

TEST(ModelCache, KeepsTheModelThatWasPutWhileTheOneBeforeWasBeingRead) {
  ModelCache* filled = nullptr;
  ModelCache cache(kRoom, [&](const std::filesystem::path& file, const std::string& id) {
    filled->put(shared_model("a", 2), "newer file");
    return load(file, id);
  });
  filled = &cache;
  cache.put(shared_model("a"), "file");
  cache.put(shared_model("b"), "b");
  EXPECT_EQ((*cache.find("a"))->generation, 1);  // who asked before gets the one before
  EXPECT_EQ((*cache.find("a"))->generation, 2);
  EXPECT_EQ(cache.usage().in_memory, 1);
}

TEST(ModelCache, SaysWhyAModelCannotBeReadAndTriesAgainTheNextTime) {
  bool is_there = false;
  ModelCache cache(kRoom, [&](const std::filesystem::path& file, const std::string& id) {
    return is_there ? load(file, id) : absl::DataLossError("Its checksum is wrong.");
  });
  cache.put(shared_model("a"), "a@1.model");
  cache.put(shared_model("b"), "b@1.model");
  const auto failed = cache.find("a");
  EXPECT_EQ(failed.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(failed.status().message()),
              HasSubstr("Model 'a' is not in memory, and its file a@1.model cannot be read: Its checksum is wrong."));
  EXPECT_TRUE(cache.find("b").ok());
  is_there = true;
  EXPECT_TRUE(cache.find("a").ok());
}

TEST(ModelCache, SurvivesALoaderThatThrows) {
  ModelCache cache(kRoom, [](const std::filesystem::path&, const std::string&) -> absl::StatusOr<StoredModel> {
    throw std::bad_alloc();
  });
  cache.put(shared_model("a"), "a");
  cache.put(shared_model("b"), "b");
  EXPECT_FALSE(cache.find("a").ok());
  EXPECT_FALSE(cache.find("a").ok());
}

TEST(ModelCache, CountsWhatIsReplacedAndErasedOnce) {
  ModelCache cache(4 * kRoom, load);
  for (int i = 0; i < 100; ++i) cache.put(shared_model("a"), "a");
  EXPECT_EQ(cache.usage().models, 1);
  EXPECT_LE(cache.usage().bytes, kRoom);
  EXPECT_TRUE(cache.erase("a"));
  EXPECT_FALSE(cache.erase("a"));
  EXPECT_EQ(cache.usage().models, 0);
  EXPECT_EQ(cache.usage().in_memory, 0);
  EXPECT_EQ(cache.usage().bytes, 0);
}

TEST(ModelCache, RefusesOnlyAModelThatAloneIsTooLarge) {
  const ModelCache cache(kBytes / 2, load);
  const absl::Status refused = cache.check_size("a", model_of("a").model);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--models-memory-mib"));
  EXPECT_TRUE(ModelCache(kRoom, load).check_size("a", model_of("a").model).ok());
}

}  // namespace
}  // namespace binpose::server
