// What the package's editor half touches of Unity's scripting API, with the signatures of 2021.3.
// Progress and preferences print or hold what they are given; JsonUtility reads as Unity's does:
// fields by name, unknown ones ignored, ArgumentException for what is not JSON.

using System;
using System.Collections;
using System.Collections.Generic;
using System.Globalization;
using System.Reflection;
using System.Text;

namespace UnityEngine
{
    public static partial class Application
    {
        public static string dataPath { get; set; }
    }

    public static class JsonUtility
    {
        public static T FromJson<T>(string json)
        {
            return (T)Filled(typeof(T), new Reader(json).Document());
        }

        static object Filled(Type type, object value)
        {
            if (type == typeof(string)) return value as string ?? "";
            if (type == typeof(bool)) return value is bool && (bool)value;
            if (type.IsPrimitive) return value is double ? Convert.ChangeType(value, type) : Activator.CreateInstance(type);
            if (type.IsArray)
            {
                var items = value as List<object> ?? new List<object>();
                var array = Array.CreateInstance(type.GetElementType(), items.Count);
                for (int i = 0; i < items.Count; i++) array.SetValue(Filled(type.GetElementType(), items[i]), i);
                return array;
            }
            object made = Activator.CreateInstance(type, true);
            var fields = value as Dictionary<string, object>;
            foreach (FieldInfo field in type.GetFields())
            {
                object stated;
                if (fields != null && fields.TryGetValue(field.Name, out stated)) field.SetValue(made, Filled(field.FieldType, stated));
            }
            return made;
        }

        sealed class Reader
        {
            readonly string text;
            int at;

            public Reader(string text) { this.text = text; }

            public object Document()
            {
                object value = Value();
                Blanks();
                if (at < text.Length || !(value is IDictionary)) throw new ArgumentException("JSON parse error");
                return value;
            }

            object Value()
            {
                Blanks();
                if (at >= text.Length) throw new ArgumentException("JSON parse error");
                if (text[at] == '{') return Members();
                if (text[at] == '[') return Items();
                if (text[at] == '"') return Text();
                int start = at;
                while (at < text.Length && "+-.0123456789eEaflnrstu".IndexOf(text[at]) >= 0) at++;
                string word = text.Substring(start, at - start);
                if (word == "true" || word == "false") return word == "true";
                if (word == "null") return null;
                double number;
                if (!double.TryParse(word, NumberStyles.Float, CultureInfo.InvariantCulture, out number)) throw new ArgumentException("JSON parse error");
                return number;
            }

            Dictionary<string, object> Members()
            {
                var members = new Dictionary<string, object>();
                for (at++; !Ends('}');)
                {
                    string name = Text();
                    Need(':');
                    members[name] = Value();
                }
                return members;
            }

            List<object> Items()
            {
                var items = new List<object>();
                for (at++; !Ends(']');) items.Add(Value());
                return items;
            }

            string Text()
            {
                Need('"');
                var made = new StringBuilder();
                while (text[at] != '"')
                {
                    char letter = text[at++];
                    if (letter != '\\') { made.Append(letter); continue; }
                    letter = text[at++];
                    if (letter == 'u') { made.Append((char)int.Parse(text.Substring(at, 4), NumberStyles.HexNumber)); at += 4; }
                    else made.Append("bfnrt".IndexOf(letter) >= 0 ? "\b\f\n\r\t"["bfnrt".IndexOf(letter)] : letter);
                }
                at++;
                return made.ToString();
            }

            bool Ends(char close)
            {
                Blanks();
                if (at < text.Length && text[at] == ',') { at++; Blanks(); }
                if (at >= text.Length) throw new ArgumentException("JSON parse error");
                if (text[at] != close) return false;
                at++;
                return true;
            }

            void Need(char letter)
            {
                Blanks();
                if (at >= text.Length || text[at++] != letter) throw new ArgumentException("JSON parse error");
            }

            void Blanks()
            {
                while (at < text.Length && char.IsWhiteSpace(text[at])) at++;
            }
        }
    }
}

namespace UnityEditor
{
    using UnityEngine;

    [AttributeUsage(AttributeTargets.Method)]
    public sealed class MenuItem : Attribute
    {
        public MenuItem(string itemName) { }
        public MenuItem(string itemName, bool isValidateFunction) { }
    }

    public static class EditorApplication
    {
        public delegate void CallbackFunction();
        public static CallbackFunction update;
        public static int Locks;
        public static void LockReloadAssemblies() { Locks++; }
        public static void UnlockReloadAssemblies() { Locks--; }
    }

    public static class EditorPrefs
    {
        static readonly Dictionary<string, string> Values = new Dictionary<string, string>();
        public static string GetString(string key, string defaultValue) { return Values.ContainsKey(key) ? Values[key] : defaultValue; }
        public static void SetString(string key, string value) { Values[key] = value; }
        public static bool GetBool(string key, bool defaultValue) { return Values.ContainsKey(key) ? Values[key] == "1" : defaultValue; }
        public static void SetBool(string key, bool value) { Values[key] = value ? "1" : "0"; }
    }

    public static class EditorGUILayout
    {
        public static string DelayedTextField(string label, string text) { return text; }
        public static bool Toggle(string label, bool value) { return value; }
    }

    public enum SettingsScope { User, Project }

    public class SettingsProvider
    {
        public SettingsProvider(string path, SettingsScope scopes, IEnumerable<string> keywords = null) { }
        public Action<string> guiHandler { get; set; }
    }

    [AttributeUsage(AttributeTargets.Method)]
    public class SettingsProviderAttribute : Attribute { }

    public static class Selection
    {
        public static string[] assetGUIDs { get; set; }
    }

    public static class AssetDatabase
    {
        public static string GUIDToAssetPath(string guid) { return guid; }
        public static bool IsValidFolder(string path) { return System.IO.Directory.Exists(System.IO.Path.Combine(Application.dataPath, "..", path)); }
        public static UnityEngine.Object LoadMainAssetAtPath(string assetPath) { return null; }
        public static void Refresh() { Console.WriteLine("refresh"); }
    }

    public class AssetPostprocessor { }

    public static class Progress
    {
        public enum Status { Running = 0, Succeeded = 1, Failed = 2, Canceled = 3 }

        [Flags]
        public enum Options { None = 0 }

        static Status status;
        static Func<bool> cancel;

        public static int Start(string name, string description = null, Options options = 0, int parentId = -1) { status = Status.Running; return 1; }
        public static void RegisterCancelCallback(int id, Func<bool> callback) { cancel = callback; }
        public static void Report(int id, int currentStep, int totalSteps, string description) { Console.WriteLine("progress: {0} of {1} {2}", currentStep, totalSteps, description); }
        public static Status GetStatus(int id) { return status; }
        public static void Finish(int id, Status status = Status.Succeeded) { Console.WriteLine("finished: " + status); }
        public static bool Cancel(int id) { if (cancel()) status = Status.Canceled; return true; }
    }
}
