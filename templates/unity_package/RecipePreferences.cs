// The preferences of Fire Atlas. Written by fire-atlas plugin unity.

namespace FireAtlas.Editor
{
    using global::UnityEditor;

    /// <summary>Where the program fire-atlas is on this machine, and when it runs.</summary>
    public static class RecipePreferences
    {
        const string Key = "FireAtlas.Command", Default = "fire-atlas", ImportKey = "FireAtlas.BuildOnImport";

        /// <summary>Name or path of the program: the user's, since a project may come from anyone.</summary>
        public static string Command
        {
            get { return EditorPrefs.GetString(Key, Default); }
            set { EditorPrefs.SetString(Key, string.IsNullOrEmpty(value) ? Default : value); }
        }

        /// <summary>Whether .fire recipes are built as they are imported: new, or changed.</summary>
        public static bool BuildOnImport
        {
            get { return EditorPrefs.GetBool(ImportKey, false); }
            set { EditorPrefs.SetBool(ImportKey, value); }
        }

        [SettingsProvider]
        static SettingsProvider Provider()
        {
            return new SettingsProvider("Preferences/Fire Atlas", SettingsScope.User)
            {
                guiHandler = _ => Show(),
            };
        }

        static void Show()
        {
            Command = EditorGUILayout.DelayedTextField("Path of fire-atlas", Command);
            BuildOnImport = EditorGUILayout.Toggle("Build .fire recipes on import", BuildOnImport);
        }
    }
}
