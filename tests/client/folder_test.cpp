#include "client/cli/folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/client/temporary_directory.h"

namespace binpose::client::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Folder, ReturnsAFileOnceItNoLongerGrows) {
  const TemporaryDirectory directory;
  Folder folder(directory.path(), {".ply"});
  const std::filesystem::path file = directory.write("a.ply", "half");
  EXPECT_THAT(folder.look(), IsEmpty());
  std::ofstream(file, std::ios::app) << " and half";
  EXPECT_THAT(folder.look(), IsEmpty());
  EXPECT_THAT(folder.look(), ElementsAre(file));
  EXPECT_THAT(folder.look(), IsEmpty());
}

TEST(Folder, ReturnsAFileAgainWhenItWasWrittenAnew) {
  const TemporaryDirectory directory;
  Folder folder(directory.path(), {".ply"});
  const std::filesystem::path file = directory.write("a.ply", "one");
  folder.skip();
  EXPECT_THAT(folder.look(), IsEmpty());
  directory.write("a.ply", "another");
  folder.look();
  EXPECT_THAT(folder.look(), ElementsAre(file));
}

TEST(Folder, SkipsWhatIsThereAtFirst) {
  const TemporaryDirectory directory;
  directory.write("old.ply", "old");
  Folder folder(directory.path(), {".ply"});
  folder.skip();
  const std::filesystem::path file = directory.write("new.ply", "new");
  folder.look();
  EXPECT_THAT(folder.look(), ElementsAre(file));
}

TEST(Folder, TakesNoOtherFilesNoEmptyOnesAndNoFolders) {
  const TemporaryDirectory directory;
  Folder folder(directory.path(), {".ply", ".pcd"});
  directory.write("notes.txt", "text");
  directory.write("empty.ply", "");
  std::filesystem::create_directory(directory.path() / "folder.ply");
  const std::filesystem::path file = directory.write("scan.pcd", "scan");
  folder.look();
  EXPECT_THAT(folder.look(), ElementsAre(file));
}

TEST(Folder, ReturnsWhatWasPutBack) {
  const TemporaryDirectory directory;
  Folder folder(directory.path(), {".ply"});
  const std::filesystem::path file = directory.write("a.ply", "one");
  folder.look();
  EXPECT_THAT(folder.look(), ElementsAre(file));
  folder.put_back(file);
  EXPECT_THAT(folder.look(), ElementsAre(file));
  EXPECT_THAT(folder.look(), IsEmpty());
}

TEST(Folder, ThatVanishesHoldsNothing) {
  Folder folder("/no/such/folder", {".ply"});
  EXPECT_THAT(folder.look(), IsEmpty());
}

}  // namespace
}  // namespace binpose::client::cli
