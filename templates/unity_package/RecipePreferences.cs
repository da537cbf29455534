// The preferences of Fire Atlas. Written by fire-atlas plugin unity.

namespace FireAtlas.Editor
{
    using global::UnityEditor;

    /// <summary>Where the program fire-atlas is on this machine.</summary>
    public static class RecipePreferences
    {
        const string Key = "FireAtlas.Command", Default = "fire-atlas";

        /// <summary>Name or path of the program.</summary>
        public static string Command
        {
            get { return EditorPrefs.GetString(Key, Default); }
            set { EditorPrefs.SetString(Key, string.IsNullOrEmpty(value) ? Default : value); }
        }

        [SettingsProvider]
        static SettingsProvider Provider()
        {
            return new SettingsProvider("Preferences/Fire Atlas", SettingsScope.User)
            {
                guiHandler = _ => Command = EditorGUILayout.DelayedTextField("Path of fire-atlas", Command),
            };
        }
    }
}
