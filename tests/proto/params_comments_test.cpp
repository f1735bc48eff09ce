// The comments of the wire API state defaults and ranges that live in core/params.h. Here each comment is read and
// tried on the server's conversion, so that neither can change alone.

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include "binpose/v1/detection_service.pb.h"
#include "binpose/v1/model_service.pb.h"
#include "server/convert_detection.h"
#include "server/convert_training.h"

namespace binpose {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// The comments of the fields of a message on one line each, in the order of the fields.
std::vector<std::string> comments_of(const google::protobuf::Descriptor& message) {
  google::protobuf::FileDescriptorSet files;
  std::ifstream stream(DESCRIPTORS, std::ios::binary);
  EXPECT_TRUE(files.ParseFromIstream(&stream));
  google::protobuf::DescriptorPool pool;
  for (const auto& file : files.file()) pool.BuildFile(file);
  const google::protobuf::Descriptor& commented = *pool.FindMessageTypeByName(message.full_name());
  std::vector<std::string> comments;
  for (int i = 0; i < commented.field_count(); ++i) {
    google::protobuf::SourceLocation location;
    commented.field(i)->GetSourceLocation(&location);
    comments.push_back(std::regex_replace(location.leading_comments, std::regex("\\s+"), " "));
  }
  return comments;
}

/// Sets a field to what a comment says: a number, a word, or for a repeated message "(a, b) and (c, d)".
void set(Message& message, const FieldDescriptor& field, const std::string& text) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return reflection.SetDouble(&message, &field, std::stod(text));
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.SetUInt32(&message, &field, static_cast<std::uint32_t>(std::stoul(text)));
    case FieldDescriptor::CPPTYPE_BOOL:
      return reflection.SetBool(&message, &field, text == "true");
    case FieldDescriptor::CPPTYPE_ENUM:
      return reflection.SetEnum(&message, &field, field.enum_type()->FindValueByName(text));
    default:
      break;
  }
  const std::regex pair(R"(\(([\d.]+), ([\d.]+)\))");
  for (std::sregex_iterator match(text.begin(), text.end(), pair); match != std::sregex_iterator(); ++match) {
    Message& element = *reflection.AddMessage(&message, &field);
    set(element, *element.GetDescriptor()->field(0), (*match)[1]);
    set(element, *element.GetDescriptor()->field(1), (*match)[2]);
  }
}

template <typename Params>
struct Case;

template <>
struct Case<v1::DetectParams> {
  static auto convert(const v1::DetectParams& message) { return server::to_detect_params(message, {}, 1); }
};

template <>
struct Case<v1::TrainParams> {
  static auto convert(const v1::TrainParams& message) { return server::to_train_params(message); }
};

template <typename Params>
class ParamsComments : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_THAT(comments_, ::testing::SizeIs(::testing::Gt(0U))); }

  /// What core gets when one field alone is set.
  static auto convert(const FieldDescriptor& field, const std::string& value) {
    Params message;
    set(message, field, value);
    return Case<Params>::convert(message);
  }

  const google::protobuf::Descriptor& descriptor_ = *Params::descriptor();
  const std::vector<std::string> comments_ = comments_of(descriptor_);
};

using Messages = ::testing::Types<v1::DetectParams, v1::TrainParams>;
TYPED_TEST_SUITE(ParamsComments, Messages);

TYPED_TEST(ParamsComments, StateTheDefaultsOfCore) {
  const auto absent = Case<TypeParam>::convert({});
  ASSERT_TRUE(absent.ok());
  for (int i = 0; i < this->descriptor_.field_count(); ++i) {
    const FieldDescriptor& field = *this->descriptor_.field(i);
    std::smatch match;
    ASSERT_TRUE(std::regex_search(this->comments_[i], match, std::regex("Default: (.+)\\. *$"))) << field.full_name();
    const auto params = this->convert(field, match[1]);
    ASSERT_TRUE(params.ok()) << params.status();
    EXPECT_EQ(*params, *absent) << field.full_name() << " is not " << match[1] << " by default";
  }
}

TYPED_TEST(ParamsComments, StateTheRangesThatAreEnforced) {
  int ranges = 0;
  for (int i = 0; i < this->descriptor_.field_count(); ++i) {
    const FieldDescriptor& field = *this->descriptor_.field(i);
    std::smatch match;
    if (!std::regex_search(this->comments_[i], match, std::regex(R"(in \[([\d.]+), ([\d.]+)\])"))) continue;
    ++ranges;
    const double low = std::stod(match[1]);
    const double high = std::stod(match[2]);
    const double step = field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ? 1e-4 * high : 1;
    EXPECT_TRUE(this->convert(field, match[1]).ok()) << field.full_name() << " refuses " << low;
    EXPECT_TRUE(this->convert(field, match[2]).ok()) << field.full_name() << " refuses " << high;
    EXPECT_FALSE(this->convert(field, std::to_string(low - step)).ok()) << field.full_name() << " takes less";
    EXPECT_FALSE(this->convert(field, std::to_string(high + step)).ok()) << field.full_name() << " takes more";
  }
  EXPECT_GT(ranges, 0);
}

}  // namespace
}  // namespace binpose
